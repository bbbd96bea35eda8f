#!/usr/bin/env python3
"""The C library's errors of every kind, called by ctypes; progress and cancelling."""

import ctypes
import math
from ctypes import byref, c_char_p, c_void_p, sizeof

import header
from library_case import Call, CLibraryTest, Credentials, Options, Progress, Summary, constant
from meshes import Mesh
from test_main import main


class Errors(CLibraryTest):
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
