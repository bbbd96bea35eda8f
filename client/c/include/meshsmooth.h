#ifndef MESHSMOOTH_H
#define MESHSMOOTH_H

/// @file
/// The C library: smooths finite-element meshes on a server. See docs/c.md.
///
/// Functions that can fail return MESHSMOOTH_OK or another meshsmooth_status. Their last parameter
/// takes the error, a new object to be freed, or null after a success; it may be null. Nothing is
/// thrown across this interface, and no result changes when a function fails.
///
/// A structure begins with its size, which the caller sets: members beyond it are zero. Every
/// member has 8 bytes. What is passed in is read during the call only.
///
/// A client may be used by several threads at a time, a session by one. Any thread may cancel.
/// Accessors of one report or error may be called by several threads until it is freed.
/// Functions that free take null.

#include <stddef.h>
#include <stdint.h>

#include "meshsmooth_options.h"

#ifdef __cplusplus
extern "C" {
#endif
#ifdef __GNUC__
#pragma GCC visibility push(default)
#endif

/// A connection to a server.
typedef struct meshsmooth_client meshsmooth_client;
/// A mesh whose nodes move from job to job while its elements stay.
typedef struct meshsmooth_session meshsmooth_session;
/// The report on one job.
typedef struct meshsmooth_report meshsmooth_report;
/// What cancels calls.
typedef struct meshsmooth_cancel meshsmooth_cancel;
/// Why a function failed.
typedef struct meshsmooth_error meshsmooth_error;

/// The version of the library, "0.2.0".
const char* meshsmooth_version(void);

/// Fills in the defaults.
/// @param options those to fill
/// @param size sizeof(meshsmooth_options), as the caller was compiled with it
int meshsmooth_options_init(meshsmooth_options* options, size_t size, meshsmooth_error** error);

// --- Errors
// ----------------------------------------------------------------------------------------

/// The status that the function returned.
int meshsmooth_error_code(const meshsmooth_error* error);
/// The stable name of the cause (docs/protocol.md, Errors), or "".
const char* meshsmooth_error_reason(const meshsmooth_error* error);
/// What failed, where, with which number, in one line.
const char* meshsmooth_error_message(const meshsmooth_error* error);
/// What to do, or "".
const char* meshsmooth_error_hint(const meshsmooth_error* error);
/// The element that is wrong, counted through all blocks; -1: none.
int64_t meshsmooth_error_element(const meshsmooth_error* error);
/// The node that is wrong; -1: none.
int64_t meshsmooth_error_node(const meshsmooth_error* error);
/// Another fact, "field" or "array" for example; null: the error has none of this name.
const char* meshsmooth_error_detail(const meshsmooth_error* error, const char* name);
/// The delay in seconds after which the same call may succeed; -1: it will not.
double meshsmooth_error_retry_seconds(const meshsmooth_error* error);
/// Frees an error and its texts.
void meshsmooth_error_free(meshsmooth_error* error);

// --- Clients
// ---------------------------------------------------------------------------------------

/// Credentials of a connection; files are PEM but for the token's. Null means unset.
typedef struct meshsmooth_credentials {
  size_t size;                  ///< sizeof(meshsmooth_credentials)
  int64_t tls;                  ///< Not 0: TLS, even when nothing below is set.
  const char* tls_ca;           ///< Authorities of the server's certificate; null: the system's.
  const char* tls_cert;         ///< Client certificate, for servers that require one.
  const char* tls_key;          ///< Key of `tls_cert`.
  const char* tls_server_name;  ///< In the server's certificate; null: the target's host.
  const char* token_file;       ///< A bearer token on one line; read anew for each call.
} meshsmooth_credentials;

/// Makes a client, which does not connect yet.
/// @param target HOST:PORT, unix:PATH, or several servers as in dns:///NAME:PORT
/// @param credentials null: neither TLS nor a token
int meshsmooth_client_create(const char* target, const meshsmooth_credentials* credentials,
                             meshsmooth_client** client, meshsmooth_error** error);
/// Frees a client. Its sessions keep the connection as long as they need it.
void meshsmooth_client_free(meshsmooth_client* client);

// --- Meshes
// ----------------------------------------------------------------------------------------

/// The type of coordinates.
enum meshsmooth_scalar {
  MESHSMOOTH_FLOAT32 = 1,  ///< float
  MESHSMOOTH_FLOAT64 = 2,  ///< double
};

/// The types of elements, with nodes in VTK's order.
enum meshsmooth_element {
  MESHSMOOTH_TRIANGLE = 1,
  MESHSMOOTH_QUAD = 2,
  MESHSMOOTH_TETRAHEDRON = 3,
  MESHSMOOTH_PYRAMID = 4,
  MESHSMOOTH_WEDGE = 5,
  MESHSMOOTH_HEXAHEDRON = 6,
  MESHSMOOTH_TRIANGLE6 = 7,
  MESHSMOOTH_QUAD8 = 8,
  MESHSMOOTH_QUAD9 = 9,
  MESHSMOOTH_TETRAHEDRON10 = 10,
  MESHSMOOTH_PYRAMID13 = 11,
  MESHSMOOTH_WEDGE15 = 12,
  MESHSMOOTH_WEDGE18 = 13,
  MESHSMOOTH_HEXAHEDRON20 = 14,
  MESHSMOOTH_HEXAHEDRON27 = 15,
};

/// Elements of one type. It has no size: meshes have arrays of these.
typedef struct meshsmooth_block {
  int64_t type;           ///< MESHSMOOTH_TETRAHEDRON …
  int64_t element_count;  ///< Number of elements.
  const int32_t* nodes;   ///< [element_count][nodes of the type], counted from 0.
} meshsmooth_block;

/// A mesh, in arrays of the caller. Null: the array is not there.
typedef struct meshsmooth_mesh {
  size_t size;                     ///< sizeof(meshsmooth_mesh)
  int64_t scalar;                  ///< Of all coordinates: MESHSMOOTH_FLOAT32 or _FLOAT64.
  int64_t node_count;              ///< Number of nodes.
  const void* positions;           ///< [node_count][3]
  int64_t block_count;             ///< Number of blocks.
  const meshsmooth_block* blocks;  ///< [block_count], all of one dimension.
  const uint8_t* fixed;            ///< [node_count], not 0: the node stays.
  const int32_t* regions;          ///< [elements]: what lies between two regions is kept.
  const void* reference;           ///< [node_count][3] of `optimize`: elements take its shapes.
  int64_t pair_count;              ///< Number of pairs.
  const int32_t* pairs;            ///< [pair_count][2]: nodes that belong together, which are held.
} meshsmooth_mesh;

/// Nodes of a mesh that go to given positions.
typedef struct meshsmooth_prescribed {
  size_t size;            ///< sizeof(meshsmooth_prescribed)
  int64_t node_count;     ///< Number of these nodes.
  const int32_t* nodes;   ///< [node_count], each once.
  const void* positions;  ///< [node_count][3] of the mesh's scalar type.
} meshsmooth_prescribed;

// --- Calls
// -----------------------------------------------------------------------------------------

/// The progress of a job, as the server last reported it.
typedef struct meshsmooth_progress {
  size_t size;              ///< As the library has it: what a caller reads beyond is not there.
  int64_t state;            ///< MESHSMOOTH_JOB_STATE_…
  int64_t queue_position;   ///< 1: next; 0: not queued.
  const char* stage;        ///< "find_neighbours", "iterate" …; "" unless the job runs.
  int64_t iteration;        ///< Sweeps so far.
  double max_displacement;  ///< Of the last sweep, in the mesh's unit.
  double rms_displacement;  ///< The same.
} meshsmooth_progress;

/// Called by the thread that made the call; the progress is valid until it returns.
/// @returns 0, or another value to cancel
typedef int (*meshsmooth_on_progress)(const meshsmooth_progress* progress, void* user_data);

/// What accompanies a call.
typedef struct meshsmooth_call {
  size_t size;                         ///< sizeof(meshsmooth_call)
  meshsmooth_cancel* cancel;           ///< Cancels the call; null: nothing does.
  meshsmooth_on_progress on_progress;  ///< Null: none.
  void* user_data;                     ///< For `on_progress`.
} meshsmooth_call;

/// Makes what cancels every call that has it.
int meshsmooth_cancel_create(meshsmooth_cancel** cancel, meshsmooth_error** error);
/// Cancels those calls, running and later ones; they fail with MESHSMOOTH_CANCELLED. Thread-safe;
/// not for signal handlers.
void meshsmooth_cancel_request(meshsmooth_cancel* cancel);
/// Frees it, after the calls that have it.
void meshsmooth_cancel_free(meshsmooth_cancel* cancel);

/// Smooths a mesh and waits for the result.
/// @param options null: the defaults
/// @param call null: no progress, not to be cancelled
/// @param result [node_count][3] of the mesh's scalar type: the mesh's own positions, to smooth in
///   place, or another array. Changes only when the whole result has arrived.
/// @param report a new object, to be freed; null: none
int meshsmooth_smooth(meshsmooth_client* client, const meshsmooth_mesh* mesh,
                      const meshsmooth_options* options, const meshsmooth_call* call, void* result,
                      meshsmooth_report** report, meshsmooth_error** error);

// --- Sessions
// --------------------------------------------------------------------------------------

/// Makes a session for many jobs on one mesh, which is copied with its reference and pairs. The
/// server keeps its topology; nothing is sent yet.
int meshsmooth_session_create(meshsmooth_client* client, const meshsmooth_mesh* mesh,
                              meshsmooth_session** session, meshsmooth_error** error);
/// Smooths the mesh at other positions.
/// @param positions [node_count][3] of the mesh's scalar type
/// @param result as of meshsmooth_smooth, in place where it is `positions`
int meshsmooth_session_smooth(meshsmooth_session* session, const void* positions,
                              const meshsmooth_options* options, const meshsmooth_call* call,
                              void* result, meshsmooth_report** report, meshsmooth_error** error);
/// Moves nodes of the mesh, as the session was made with it, to given positions; the rest follows
/// and stays valid. Does not depend on earlier calls.
/// @param options whose method is MESHSMOOTH_METHOD_MOVE; null: its defaults
/// @param result [node_count][3]: the whole mesh. How far the motion came is `motion_reached` of
///   the summary.
int meshsmooth_session_move(meshsmooth_session* session, const meshsmooth_prescribed* prescribed,
                            const meshsmooth_options* options, const meshsmooth_call* call,
                            void* result, meshsmooth_report** report, meshsmooth_error** error);
/// Frees a session, before or after its client.
void meshsmooth_session_free(meshsmooth_session* session);

// --- Reports
// ---------------------------------------------------------------------------------------

/// The main figures of a report. A metric that no element has, or that was not evaluated, is NaN.
typedef struct meshsmooth_summary {
  size_t size;                        ///< sizeof(meshsmooth_summary), set by the caller.
  int64_t stop_reason;                ///< MESHSMOOTH_STOP_REASON_…
  int64_t end_rule;                   ///< MESHSMOOTH_END_RULE_…
  int64_t iteration_count;            ///< Sweeps.
  int64_t node_count;                 ///< Of the mesh.
  int64_t boundary_node_count;        ///< On facets of one element.
  int64_t fixed_node_count;           ///< That were not to move, for whatever reason.
  int64_t moved_node_count;           ///< Whose position differs from the input.
  int64_t restored_node_count;        ///< That went back for `never_worse`.
  int64_t element_count;              ///< Of the mesh, without those without thickness.
  int64_t locked_element_count;       ///< Whose nodes are all fixed.
  int64_t inverted_count_before;      ///< Elements that are inverted in the input,
  int64_t inverted_count_after;       ///< and in the result.
  int64_t degenerate_count_before;    ///< Not inverted, but not certainly valid either,
  int64_t degenerate_count_after;     ///< the same of the result.
  double min_mean_ratio_before;       ///< 1 is ideal, negative inverted.
  double min_mean_ratio_after;        ///< The least of the result.
  double mean_mean_ratio_before;      ///< The mean of all elements.
  double mean_mean_ratio_after;       ///< The same of the result.
  double min_scaled_jacobian_before;  ///< 1 is ideal, negative inverted.
  double min_scaled_jacobian_after;   ///< The least of the result.
  double motion_reached;              ///< Share of the motion, [0, 1]; NaN unless nodes were moved.
  double queue_seconds;               ///< Time in the server's queue.
  int64_t topology_reused;            ///< 1: the server had prepared the topology before.
  int64_t shared_memory;              ///< 1: the mesh travelled through shared memory.
} meshsmooth_summary;

/// Fills in as much as the caller's structure has.
int meshsmooth_report_summary(const meshsmooth_report* report, meshsmooth_summary* summary,
                              meshsmooth_error** error);
/// The whole report, meshsmooth.v1.Summary of docs/protocol.md, as JSON.
/// @param json a text that is valid until the report is freed
int meshsmooth_report_json(const meshsmooth_report* report, const char** json,
                           meshsmooth_error** error);
/// The server's name of the job, "jobs/…"; valid until the report is freed.
const char* meshsmooth_report_job_name(const meshsmooth_report* report);
/// The version of the server; valid until the report is freed.
const char* meshsmooth_report_server_version(const meshsmooth_report* report);
/// Frees a report and its texts.
void meshsmooth_report_free(meshsmooth_report* report);

#ifdef __GNUC__
#pragma GCC visibility pop
#endif
#ifdef __cplusplus
}
#endif

#endif  // MESHSMOOTH_H
