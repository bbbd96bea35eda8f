#!/usr/bin/env python3
"""The C library's results, called by ctypes: the C++ client's bits, reports, sessions, motions."""

import ctypes
import math
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from ctypes import byref, c_double, c_float, c_int32, c_uint8, c_void_p, sizeof

from library_case import CLibraryTest, Options, Prescribed, Summary, constant
from meshes import Mesh, array
from test_main import main


class Results(CLibraryTest):
    def test_smooths_in_place_to_the_bits_of_cpp(self):
        positions = self.mesh.positions()
        summary, report = self.smooth(self.mesh.as_c(positions), positions)
        self.assertEqual(bytes(positions), self.of_cpp("smooth"))
        self.assertNotEqual(bytes(positions), bytes(self.mesh.positions()))
        self.assertEqual(summary.inverted_count_after, 0)
        self.assertEqual(summary.node_count, self.mesh.node_count)
        self.assertEqual(summary.element_count, self.mesh.element_count)
        self.assertGreater(summary.min_mean_ratio_after, summary.min_mean_ratio_before)
        self.assertTrue(math.isnan(summary.motion_reached))
        self.assertIn("quality_after", report)

    def test_smooths_into_another_array(self):
        positions, result = self.mesh.positions(), self.mesh.positions()
        self.smooth(self.mesh.as_c(positions), result, self.options())
        self.assertEqual(bytes(positions), bytes(self.mesh.positions()))
        self.assertEqual(bytes(result), self.of_cpp("smooth"))

    def test_smooths_float32_to_the_bits_of_cpp(self):
        positions = self.mesh.positions(c_float)
        summary, _ = self.smooth(self.mesh.as_c(positions), positions)
        self.assertEqual(summary.inverted_count_after, 0)
        self.assertEqual(bytes(positions), self.of_cpp("smooth32"))

    def test_stays_in_memory_when_it_is_unloaded(self):
        """Threads of gRPC outlive the last client."""
        code = ("import _ctypes, ctypes, sys; _ctypes.dlclose(ctypes.CDLL(sys.argv[1])._handle); "
                "print(sys.argv[1] in open('/proc/self/maps').read())")
        path = os.path.realpath(os.environ["MESHSMOOTH_C_LIBRARY"])
        answer = subprocess.run([sys.executable, "-c", code, path], capture_output=True, text=True, check=True)
        self.assertEqual(answer.stdout, "True\n")

    def test_threads_share_a_client(self):
        expected = self.of_cpp("smooth")

        def smoothed(_):
            positions = self.mesh.positions()
            self.smooth(self.mesh.as_c(positions), positions)
            return bytes(positions)

        with ThreadPoolExecutor(4) as pool:
            self.assertEqual(set(pool.map(smoothed, range(16))), {expected})

    def test_options_are_those_of_cpp(self):
        positions = self.mesh.positions()
        options = self.options(method=constant("METHOD_TAUBIN"), mu=-0.55, iterations=7, guard=0, never_worse=0,
                               boundary=constant("BOUNDARY_POLICY_FREE"), movement_limit=0.02, movement_limit_relative=1)
        setattr(options, "lambda", 0.5)
        summary, _ = self.smooth(self.mesh.as_c(positions), positions, options)
        self.assertEqual(bytes(positions), self.of_cpp("taubin"))
        self.assertEqual(summary.iteration_count, 7)
        self.assertEqual(summary.stop_reason, constant("STOP_REASON_ITERATION_LIMIT"))

    def test_programs_that_know_fewer_options_have_the_defaults_of_the_others(self):
        options = self.options(iterations=3, guard=0)  # beyond what the size says
        options.size = Options.method.offset + 8
        positions = self.mesh.positions()
        self.smooth(self.mesh.as_c(positions), positions, options)
        self.assertEqual(bytes(positions), self.of_cpp("smooth"))

    def test_summaries_fill_what_the_program_knows(self):
        positions = self.mesh.positions()
        report = c_void_p()
        self.check("smooth", self.client, byref(self.mesh.as_c(positions)), None, None, positions, byref(report))
        self.addCleanup(self.library.report_free, report)
        summary = Summary(size=16, end_rule=-5)
        self.check("report_summary", report, byref(summary))
        self.assertEqual((summary.size, summary.end_rule), (16, -5))
        self.assertGreater(summary.stop_reason, 0)

    def test_fixed_nodes_pairs_regions_and_reference_count(self):
        inner = self.mesh.inner
        fixed = array(c_uint8, [node in inner[:10] for node in range(self.mesh.node_count)])
        pairs = array(c_int32, [inner[10], inner[11], inner[12], inner[13]])
        regions = array(c_int32, [element % 2 for element in range(self.mesh.element_count)])
        reference = Mesh(seed=2).positions()
        positions = self.mesh.positions()
        _, report = self.smooth(self.mesh.as_c(positions, fixed=fixed, pairs=pairs, pair_count=2), positions)
        for node in inner[:14]:
            self.assertEqual(positions[3 * node:3 * node + 3], self.mesh.coordinates[3 * node:3 * node + 3])
        self.assertEqual(int(report["nodes"]["paired"]), 4)
        _, split = self.smooth(self.mesh.as_c(self.mesh.positions(), regions=regions), positions)
        self.assertNotEqual(split["nodes"], report["nodes"])
        self.smooth(self.mesh.as_c(self.mesh.positions(), reference=reference), positions)
        self.assertNotEqual(bytes(positions), self.of_cpp("smooth"))

    # --- sessions ----------------------------------------------------------------------------------

    def test_sessions_keep_the_topology_and_outlive_their_client(self):
        client = c_void_p()
        self.check("client_create", self.target.encode(), None, byref(client))
        session, positions = c_void_p(), self.mesh.positions()
        self.check("session_create", client, byref(self.mesh.as_c(positions)), byref(session))
        self.library.client_free(client)
        reused = []
        for _ in range(2):
            report = c_void_p()
            self.check("session_smooth", session, positions, byref(self.options(iterations=1)), None, positions, byref(report))
            reused.append(self.told(report)[0].topology_reused)
        self.library.session_free(session)
        self.assertEqual(reused[1], 1)
        self.assertEqual(bytes(positions), self.of_cpp("session"))

    def test_moves_prescribed_nodes_and_lets_the_rest_follow(self):
        mesh = Mesh(jitter=0.05)
        session, result = self.make_session(mesh.as_c(mesh.positions())), mesh.positions()
        nodes, places = array(c_int32, mesh.prescribed), array(c_double, mesh.places)
        prescribed = Prescribed(sizeof(Prescribed), len(nodes), ctypes.addressof(nodes), ctypes.addressof(places))
        report = c_void_p()
        self.check("session_move", session, byref(prescribed), None, None, result, byref(report))
        summary, _ = self.told(report)
        self.assertEqual((summary.motion_reached, summary.inverted_count_after), (1, 0))
        for index, node in enumerate(mesh.prescribed):
            self.assertEqual(result[3 * node:3 * node + 3], places[3 * index:3 * index + 3])
        expected = self.of_cpp("move", mesh)
        self.assertEqual(bytes(result), expected)
        result = mesh.positions()
        options = self.options(method=constant("METHOD_MOVE"))
        self.check("session_move", session, byref(prescribed), byref(options), None, result, None)
        self.assertEqual(bytes(result), expected)
        self.fails("session_move", session, byref(prescribed), byref(self.options()), None, result, None,
                   reason="OPTION_NOT_SUPPORTED")

    def test_moves_float32(self):
        mesh = Mesh(jitter=0.05)
        positions = mesh.positions(c_float)
        session, nodes = self.make_session(mesh.as_c(positions)), array(c_int32, mesh.prescribed)
        places = array(c_float, mesh.places)
        prescribed = Prescribed(sizeof(Prescribed), len(nodes), ctypes.addressof(nodes), ctypes.addressof(places))
        self.check("session_move", session, byref(prescribed), None, None, positions, None)
        for index, node in enumerate(mesh.prescribed):
            self.assertEqual(positions[3 * node:3 * node + 3], places[3 * index:3 * index + 3])


if __name__ == "__main__":
    main()
