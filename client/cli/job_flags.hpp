#pragma once

// Made by scripts/tables from proto/declaration; do not edit.
// clang-format off


namespace meshsmooth::cli {

/// A flag of the command line.
struct Flag {
  const char* name;
  const char* help;
};

namespace flag {

inline constexpr Flag method{"--method", "Smoothing method"};
inline constexpr Flag iterations{"--iterations", "Iteration limit; 0 only evaluates the mesh [taubin 20, hc-laplacian 10, windowed-sinc 20, others 1000]"};
inline constexpr Flag move_iterations{"--iterations", "Limit of the sweeps of all steps; 0: the displacement alone is continued into the mesh [10000]"};
inline constexpr Flag tolerance{"--tolerance", "Largest move that ends the run, as a share of the bounding box's diagonal; optimize: smallest decrease of the energies in a sweep, as a share [1e-4]"};
inline constexpr Flag absolute_tolerance{"--absolute-tolerance", "Largest move that ends the run, in the mesh's unit"};
inline constexpr Flag compute_budget{"--compute-budget", "Computing time after which the best result so far is returned, in seconds [none]"};
inline constexpr Flag boundary{"--boundary", "Boundary nodes. slide: they move in their plane, on their curved part or along their crease, corners stay; free: they move like all others. In both, the file's lower-dimensional cells move with their nodes"};
inline constexpr Flag feature_angle{"--feature-angle", "Largest angle between planes of one curved part, with --boundary slide, or between facets without a feature edge, of optimize on a surface mesh, in degrees, [1, 90] [30]"};
inline constexpr Flag fixed_types{"--fixed-types", "Element types whose nodes are fixed, separated by commas"};
inline constexpr Flag regions{"--regions", "Regions of elements, by a cell array of whole numbers: facets between elements of different numbers are kept as the boundary is. auto: physical groups, Medit's references, TetGen's first attribute, Gmsh's entities, Abaqus's materials or OpenFOAM's cell zones, whichever the file has; none: no regions"};
inline constexpr Flag merge_coincident{"--merge-coincident", "Smooth nodes at the same position as one, as of separate triangles; the file keeps all its nodes"};
inline constexpr Flag periodic{"--periodic", "Two sets of nodes, by name as --fixed-set, that a translation or rotation takes to each other: their nodes stay matched, being held; may be repeated"};
inline constexpr Flag file_pairs{"--file-pairs", "Pairs of nodes that the file names, as $Periodic of MSH, *EQUATION of Abaqus, connectivities of CGNS or cyclic patches of OpenFOAM; off: they are ignored"};
inline constexpr Flag movement_limit{"--movement-limit", "Largest distance of a node from its original position, in the mesh's unit or, with %, as a share of the bounding box's diagonal [none]"};
inline constexpr Flag only_below{"--only-below", "Mean ratio, for optimize against the target: only elements below it are improved, (0, 1] [all are]"};
inline constexpr Flag only_below_rings{"--only-below-rings", "Rings of nodes around the elements of --only-below that move too [2]"};
inline constexpr Flag reference{"--reference", "optimize: mesh file with the same elements, whose shapes they take; what slides where is read from it too"};
inline constexpr Flag surface{"--surface", "optimize: surface mesh file on which the boundary's nodes shall lie; they go there as far as elements stay valid, and slide along it, its feature edges and corners are kept; --boundary is slide then [none]"};
inline constexpr Flag guard{"--guard", "Guard of valid elements; off: they may come back inverted"};
inline constexpr Flag never_worse{"--never-worse", "Nodes go back where the worst element or the mean quality would be worse than before; off: they do not, as without the guard"};
inline constexpr Flag metric{"--metric", "Metric of --never-worse; scaled-jacobian: optimize raises its least value too [the worst element by both; the mean of mean-ratio for triangles and tetrahedra, of scaled-jacobian else]"};
inline constexpr Flag tangled{"--tangled", "Treatment of a mesh with inverted elements"};
inline constexpr Flag report_below{"--report-below", "Mean ratio against the target: elements of the result below it are counted by what holds them there (optimize only), (0, 1] [none]"};
inline constexpr Flag form{"--form", "Order of the moves in a sweep [the method's first]"};
inline constexpr Flag history{"--history", "Moves, energy and worst mean ratio of each sweep in the report"};
inline constexpr Flag element_quality{"--element-quality", "Metrics of the result to write as cell arrays, separated by commas; not a number (NaN) where an element has no such metric"};
inline constexpr Flag backend{"--backend", "Backend"};
inline constexpr Flag timeout{"--timeout", "Timeout of the whole call, in seconds [derived from the size of the mesh]"};
inline constexpr Flag result_ttl{"--result-ttl", "Time that the server keeps the result for `attach`, in seconds [0]"};
inline constexpr Flag request_id{"--request-id", "UUID of the job [a new one]"};
inline constexpr Flag traceparent{"--traceparent", "Span of the caller, in the format of W3C Trace Context; otherwise that of the variable TRACEPARENT [none]"};
inline constexpr Flag displacement{"--displacement", "Point array of REFERENCE, three numbers a node: the way of the prescribed nodes"};
inline constexpr Flag to{"--to", "Mesh file with the same elements, where the prescribed nodes lie as they shall; its other nodes do not count"};

}  // namespace flag

}  // namespace meshsmooth::cli
