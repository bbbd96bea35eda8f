#!/usr/bin/env python3
"""Times the steps of the pipeline beside SciPy on one mesh, in one run.

    against_scipy.py CORE_BENCH MESH.vtu [-n ROUNDS]

SciPy's way of one uniform Jacobi sweep is a CSR product with the positions; its
way of finding the neighbours is COO -> CSR with duplicates summed. Rounds of
both sides alternate; medians and their ratios are printed.
"""

import argparse
import json
import statistics
import subprocess
import time

import numpy
import scipy.sparse
import vtk
from vtk.util.numpy_support import vtk_to_numpy


def read(path):
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    grid = reader.GetOutput()
    positions = vtk_to_numpy(grid.GetPoints().GetData()).astype(numpy.float64)
    nodes = vtk_to_numpy(grid.GetCells().GetConnectivityArray())
    return positions, nodes.reshape(-1, 4).astype(numpy.int32)


def directed_edges(tets):
    pairs = [(a, b) for a in range(4) for b in range(4) if a != b]
    rows = numpy.concatenate([tets[:, a] for a, _ in pairs])
    columns = numpy.concatenate([tets[:, b] for _, b in pairs])
    return rows, columns


def seconds(body):
    start = time.perf_counter()
    result = body()
    return time.perf_counter() - start, result


def scipy_round(positions, rows, columns):
    count = len(positions)
    ones = numpy.ones(len(rows))

    def neighbours():
        matrix = scipy.sparse.coo_matrix((ones, (rows, columns)), shape=(count, count)).tocsr()
        matrix.sum_duplicates()
        return matrix

    neighbour_seconds, matrix = seconds(neighbours)
    matrix.data[:] = 1.0
    degree = numpy.asarray(matrix.sum(axis=1)).ravel()
    matrix = scipy.sparse.diags(1.0 / numpy.maximum(degree, 1)).dot(matrix).tocsr()
    matrix.dot(positions)
    sweeps = [seconds(lambda: matrix.dot(positions))[0] for _ in range(5)]
    return neighbour_seconds, statistics.median(sweeps)


def bench_round(program, mesh):
    out = subprocess.run(
        [program, mesh, "--benchmark_format=json",
         "--benchmark_filter=find_neighbours|uniform_jacobi"],
        check=True, capture_output=True, text=True).stdout
    return {b["name"].replace("/real_time", ""): b["real_time"] / 1e3
            for b in json.loads(out)["benchmarks"]}


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("core_bench")
    arguments.add_argument("mesh")
    arguments.add_argument("-n", "--rounds", type=int, default=3)
    options = arguments.parse_args()

    positions, tets = read(options.mesh)
    rows, columns = directed_edges(tets)
    print(f"{len(positions)} nodes, {len(tets)} tetrahedra, SciPy {scipy.__version__}, "
          f"{options.rounds} rounds, medians")
    theirs, ours = [], []
    for _ in range(options.rounds):
        theirs.append(scipy_round(positions, rows, columns))
        ours.append(bench_round(options.core_bench, options.mesh))

    def median(name, threads):
        return statistics.median(r[f"{name}/threads:{threads}"] for r in ours)

    for index, (name, label) in enumerate([
            ("find_neighbours_and_boundary", "neighbours (ours: + boundary, renumbering)"),
            ("uniform_jacobi_sweep", "one uniform Jacobi sweep")]):
        scipy_seconds = statistics.median(r[index] for r in theirs)
        one, two = median(name, 1), median(name, 2)
        print(f"{label}: SciPy {scipy_seconds * 1e3:.1f} ms, ours {one * 1e3:.1f} ms (1 thread), "
              f"{two * 1e3:.1f} ms (2 threads); "
              f"{scipy_seconds / one:.2f}x SciPy, {one / two:.2f}x from 1 to 2 threads")


if __name__ == "__main__":
    main()
