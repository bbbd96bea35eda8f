/* Smooths one tetrahedron, split into four at an off-centre node, on a server at HOST:PORT. */
#include <inttypes.h>
#include <meshsmooth.h>
#include <stdio.h>

static int failed(meshsmooth_error* error) {
  fprintf(stderr, "%s: %s\n%s\n", meshsmooth_error_reason(error), meshsmooth_error_message(error),
          meshsmooth_error_hint(error));
  if (meshsmooth_error_element(error) >= 0)
    fprintf(stderr, "element %" PRId64 "\n", meshsmooth_error_element(error));
  meshsmooth_error_free(error);
  return 1;
}

int main(int argc, char** argv) {
  double positions[5][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.1, 0.1, 0.1}};
  const int32_t nodes[4][4] = {{4, 1, 2, 3}, {0, 4, 2, 3}, {0, 1, 4, 3}, {0, 1, 2, 4}};
  const meshsmooth_block block = {MESHSMOOTH_TETRAHEDRON, 4, &nodes[0][0]};
  const meshsmooth_mesh mesh = {.size = sizeof mesh,
                                .scalar = MESHSMOOTH_FLOAT64,
                                .node_count = 5,
                                .positions = positions,
                                .block_count = 1,
                                .blocks = &block};
  meshsmooth_client* client = NULL;
  meshsmooth_report* report = NULL;
  meshsmooth_error* error = NULL;
  meshsmooth_options options;
  meshsmooth_summary summary = {.size = sizeof summary};

  if (argc != 2) return fprintf(stderr, "usage: smooth HOST:PORT\n"), 2;
  if (meshsmooth_options_init(&options, sizeof options, &error)) return failed(error);
  options.goal = MESHSMOOTH_GOAL_WORST;
  if (meshsmooth_client_create(argv[1], NULL, &client, &error)) return failed(error);
  const int status = meshsmooth_smooth(client, &mesh, &options, NULL, positions, &report, &error);
  meshsmooth_client_free(client);
  if (status || meshsmooth_report_summary(report, &summary, &error)) return failed(error);
  printf("inverted: %" PRId64 ", moved: %" PRId64 "\n", summary.inverted_count_after,
         summary.moved_node_count);
  printf("node 4: %.17g %.17g %.17g\n", positions[4][0], positions[4][1], positions[4][2]);
  meshsmooth_report_free(report);
  return 0;
}
