"""What tests of the C library share: its structures, a server, calls that raise its errors."""

import json
import os
import subprocess
import unittest
from ctypes import byref, c_char_p, c_void_p, sizeof

import header
from meshes import CONSTANTS, Mesh
from programs import SERVER, Program

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


class CLibraryTest(unittest.TestCase):
    """A test with a server and a client of it."""

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
