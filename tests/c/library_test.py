#!/usr/bin/env python3
"""The C library, called by ctypes: the C++ client's bits, the errors of every kind, progress, cancelling, sessions."""

import ctypes
import json
import math
import os
import subprocess
import unittest
from ctypes import byref, c_char_p, c_double, c_float, c_int32, c_uint8, c_void_p, sizeof

import header
from meshes import CONSTANTS, Mesh, array
from programs import SERVER, Program
from test_main import main

Options = header.structure("meshsmooth_options")
Call = header.structure("meshsmooth_call")
Summary = header.structure("meshsmooth_summary")
Progress = header.structure("meshsmooth_progress")
Prescribed = header.structure("meshsmooth_prescribed")
Credentials = header.structure("meshsmooth_credentials")


def constant(name):
    return CONSTANTS["MESHSMOOTH_" + name]


class Failed(Exception):
    """An error of the library, with all that it tells."""

    def __init__(self, library, status, error):
        super().__init__(library.error_message(error).decode())
        self.status, self.code = status, library.error_code(error)
        self.reason, self.hint = library.error_reason(error).decode(), library.error_hint(error).decode()
        self.element, self.node = library.error_element(error), library.error_node(error)
        self.field = library.error_detail(error, b"field")
        self.retry_seconds = library.error_retry_seconds(error)


class CLibrary(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.library = header.Library()
        cls.server = Program(SERVER, "--listen", "unix:", "--backend", "cpu", "--lanes", "1", "--lame-duck-seconds", "0")
        cls.addClassCleanup(cls.server.kill)
        cls.target = "unix:" + cls.server.wait_for(r"event=start.* listen=unix:(\S+)").group(1)
        cls.mesh = Mesh()

    def setUp(self):
        self.client = self.make_client(self.target)

    def make_client(self, target, credentials=None):
        client = c_void_p()
        self.check("client_create", target.encode(), credentials, byref(client))
        self.addCleanup(self.library.client_free, client)
        return client

    def check(self, function, *arguments):
        """Calls a function whose last parameter takes the error, and raises it."""
        error = c_void_p(1)
        status = getattr(self.library, function)(*arguments, byref(error))
        if status == constant("OK"):
            self.assertIsNone(error.value)
            return
        self.assertIsNotNone(error.value)
        try:
            raise Failed(self.library, status, error)
        finally:
            self.library.error_free(error)

    def fails(self, function, *arguments, reason, code="INVALID_ARGUMENT"):
        with self.assertRaises(Failed) as raised:
            self.check(function, *arguments)
        failed = raised.exception
        self.assertEqual((failed.reason, failed.code, failed.status), (reason, constant(code), constant(code)), failed)
        return failed

    def options(self, **members):
        options = Options()
        self.check("options_init", byref(options), sizeof(options))
        for name, value in members.items():
            setattr(options, name, value)
        return options

    def smooth(self, mesh, result, options=None, call=None):
        """The whole report: summary and JSON."""
        report = c_void_p()
        self.check("smooth", self.client, byref(mesh), options and byref(options), call and byref(call), result, byref(report))
        return self.told(report)

    def told(self, report):
        summary, text = Summary(size=sizeof(Summary)), c_char_p()
        self.check("report_summary", report, byref(summary))
        self.check("report_json", report, byref(text))
        found = json.loads(text.value)
        self.assertTrue(self.library.report_job_name(report).startswith(b"jobs/"))
        self.assertEqual(self.library.report_server_version(report), self.library.version())
        self.library.report_free(report)
        return summary, found

    def make_session(self, mesh):
        session = c_void_p()
        self.check("session_create", self.client, byref(mesh), byref(session))
        self.addCleanup(self.library.session_free, session)
        return session

    def of_cpp(self, what, mesh=None):
        return subprocess.run([os.environ["MESHSMOOTH_CPP_CLIENT"], self.target, what], input=(mesh or self.mesh).in_bytes(),
                              stdout=subprocess.PIPE, check=True, timeout=120).stdout

    # --- results -----------------------------------------------------------------------------------

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

    # --- errors ------------------------------------------------------------------------------------

    def test_wrong_connectivity_names_element_and_node(self):
        mesh = Mesh()
        mesh.tetrahedra[4 * 42 + 1] = mesh.node_count
        positions = mesh.positions()
        failed = self.fails("smooth", self.client, byref(mesh.as_c(positions)), None, None, positions, None,
                            reason="INDEX_OUT_OF_RANGE")
        self.assertEqual((failed.element, failed.node), (42, mesh.node_count))
        self.assertEqual(bytes(positions), bytes(mesh.positions()))

    def test_no_server_is_told_with_a_hint(self):
        positions = self.mesh.positions()
        options = self.options(max_attempts=1)
        failed = self.fails("smooth", self.make_client("unix:/nowhere/socket"), byref(self.mesh.as_c(positions)),
                            byref(options), None, positions, None, reason="", code="UNAVAILABLE")
        self.assertIn("no server answers there", failed.hint)
        self.assertEqual((failed.element, failed.node, failed.retry_seconds), (-1, -1, -1))

    def test_credentials_that_cannot_be_used_are_named(self):
        credentials = Credentials(size=sizeof(Credentials), token_file=b"/nowhere/token")
        self.fails("client_create", b"localhost:1", byref(credentials), byref(c_void_p()), reason="CREDENTIALS_UNUSABLE")
        credentials = Credentials(size=sizeof(Credentials), tls_ca=b"/nowhere/ca.pem")
        self.fails("client_create", b"localhost:1", byref(credentials), byref(c_void_p()), reason="CREDENTIALS_UNUSABLE")

    def test_null_arguments_are_errors(self):
        positions, session = self.mesh.positions(), self.make_session(self.mesh.as_c(self.mesh.positions()))
        mesh, empty = self.mesh.as_c(positions), self.mesh.as_c(positions, blocks=None)
        for field, function, *arguments in (
                ("target", "client_create", None, None, byref(c_void_p())),
                ("client", "client_create", b"localhost:1", None, None),
                ("client", "smooth", None, byref(mesh), None, None, positions, None),
                ("mesh", "smooth", self.client, None, None, None, positions, None),
                ("result", "smooth", self.client, byref(mesh), None, None, None, None),
                ("meshsmooth_mesh.blocks", "smooth", self.client, byref(empty), None, None, positions, None),
                ("meshsmooth_mesh.pairs", "smooth", self.client, byref(self.mesh.as_c(positions, pair_count=1)), None, None,
                 positions, None),
                ("session", "session_create", self.client, byref(mesh), None),
                ("session", "session_smooth", None, positions, None, None, positions, None),
                ("positions", "session_smooth", session, None, None, None, positions, None),
                ("prescribed", "session_move", session, None, None, None, positions, None),
                ("cancel", "cancel_create", None),
                ("options", "options_init", None, sizeof(Options)),
                ("report", "report_summary", None, byref(Summary(size=sizeof(Summary)))),
                ("report", "report_json", None, byref(c_char_p()))):
            with self.subTest(function=function, field=field):
                self.assertEqual(self.fails(function, *arguments, reason="ARGUMENT_INVALID").field, field.encode())
        self.assertEqual(self.library.smooth(None, None, None, None, None, None, None), constant("INVALID_ARGUMENT"))
        for free in ("client", "session", "report", "cancel", "error"):
            getattr(self.library, free + "_free")(None)

    def test_sizes_of_another_library_are_errors(self):
        positions = self.mesh.positions()
        for size in (0, 8, 20, sizeof(Options) + 8):
            with self.subTest(size):
                options = self.options(size=size)
                failed = self.fails("smooth", self.client, byref(self.mesh.as_c(positions)), byref(options), None, positions,
                                    None, reason="ARGUMENT_INVALID")
                self.assertIn(f"meshsmooth_options.size is {size}", str(failed))
                self.fails("options_init", byref(options), size, reason="ARGUMENT_INVALID")
                self.fails("smooth", self.client, byref(self.mesh.as_c(positions, size=size % 4)), None, None, positions,
                           None, reason="ARGUMENT_INVALID")

    def test_values_out_of_range_are_named(self):
        positions = self.mesh.positions()
        for name, value in (("method", 99), ("method", 0), ("goal", 4), ("goal", -1), ("backend", 3), ("iterations", -2),
                            ("iterations", 2**40), ("feature_angle", math.nan), ("timeout_seconds", -1),
                            ("compute_budget_seconds", math.inf), ("report_below", 1.5)):
            with self.subTest(name=name, value=value):
                failed = self.fails("smooth", self.client, byref(self.mesh.as_c(positions)),
                                    byref(self.options(**{name: value})), None, positions, None, reason="OPTION_OUT_OF_RANGE")
                self.assertIn(name, failed.field.decode())
        failed = self.fails("smooth", self.client, byref(self.mesh.as_c(positions, scalar=3)), None, None, positions, None,
                            reason="ARGUMENT_INVALID")
        self.assertIn("MESHSMOOTH_FLOAT64", str(failed))

    # --- progress and cancelling -------------------------------------------------------------------

    def long_job(self, on_progress, cancel=None):
        """A job that only cancelling ends: its nodes need minutes to come to rest."""
        mesh = Mesh(27)
        positions = mesh.positions()
        callback = header.ON_PROGRESS(on_progress)
        call = Call(size=sizeof(Call), cancel=cancel, on_progress=callback, user_data=7)
        options = self.options(method=constant("METHOD_LAPLACIAN"), guard=0, never_worse=0, relaxation=0.05, tolerance=0,
                               iterations=2_000_000_000)
        self.fails("smooth", self.client, byref(mesh.as_c(positions)), byref(options), byref(call), positions, None,
                   reason="", code="CANCELLED")
        self.assertEqual(bytes(positions), bytes(mesh.positions()))

    def test_a_progress_callback_cancels(self):
        seen = []

        def on_progress(progress, user_data):
            shown = ctypes.cast(progress, ctypes.POINTER(Progress)).contents
            seen.append((shown.state, shown.stage, shown.iteration, user_data))
            return int(shown.iteration > 0)

        self.long_job(on_progress)
        self.assertEqual(seen[-1][:2], (constant("JOB_STATE_RUNNING"), b"iterate"))
        self.assertEqual(seen[-1][3], 7)

    def test_a_handle_cancels_running_and_later_calls(self):
        cancel = c_void_p()
        self.check("cancel_create", byref(cancel))
        self.addCleanup(self.library.cancel_free, cancel)

        def on_progress(*_):
            self.library.cancel_request(cancel)
            return 0

        self.long_job(on_progress, cancel)
        self.long_job(lambda *_: 0, cancel)


if __name__ == "__main__":
    main()
