"""The gateway's OpenAPI document, from which the program itself takes the parameters that it knows."""

import json

import enums
import methods
from common import interval
from options import iterations, options

FILE = "client/gateway/openapi.json"
# Options that `move` shares with `smooth`; all others are of one of them.
OF_MOVE = ("tolerance", "absolute_tolerance", "compute_budget", "boundary", "feature_angle", "movement_limit",
           "report_below", "history")
OF_BOTH = (*OF_MOVE, "fixed_types", "regions", "merge_coincident", "periodic", "file_pairs", "element_quality", "backend",
           "timeout")
# Files, which are parts of the form, and what a client of the service alone has use for.
NO_PARAMETERS = ("reference", "surface", "to", "result_ttl", "request_id",
                 "traceparent")
LISTS = ("fixed_types", "element_quality")
SWITCH = {"type": "string", "enum": ["on", "off"]}


def parameter(name, text, schema, several=False):
    of = {"name": name, "in": "query", "description": text, "schema": schema}
    if several:
        of["schema"] = {"type": "array", "items": schema}
    return of


def number(of, whole):
    schema = {"type": "integer" if whole else "number"}
    _, _, _, other = interval(of)
    lower, upper = of["range"][1:-1].split(", ")
    if lower != "-inf":
        schema["minimum" if of["range"][0] == "[" else "exclusiveMinimum"] = float(lower) if "." in lower else int(lower)
    if upper != "inf" and not other:
        schema["maximum" if of["range"][-1] == "]" else "exclusiveMaximum"] = float(upper) if "." in upper else int(upper)
    return schema


def schema_of(of):
    choices = dict(enums.literals())
    kind = of["type"]
    if kind == "bool":
        return SWITCH
    if "values" in of:
        return {"type": "string", "enum": [value.replace("_", "-") for value in of["values"]]}
    if "range" in of and kind in ("int", "number", "seconds"):
        return number(of, kind == "int")
    declared_enum = {name: enum.get("python") for name, enum in enums.declared("enums").items()}
    if declared_enum.get(kind) in choices:
        return {"type": "string", "enum": choices[declared_enum[kind]]}
    return {"type": "number", "exclusiveMinimum": 0} if kind == "seconds" else {"type": "string"}


def method_parameters(motion):
    found = {}
    for method, of in methods.methods():
        if (method == "move") != motion:
            continue
        for name, field in of["fields"].items():
            if field.get("by_call"):  # answered by no file
                continue
            if name not in found:
                found[name] = (field, [])
            found[name][1].append(method.replace("_", "-"))
    for name, (field, owners) in found.items():
        kind = {"type": "number"} | field
        help_text = field["help"] if motion else f"{', '.join(owners)}: {field['help']}"
        yield parameter(name.replace("_", "-"), help_text, schema_of(kind))


def job_parameters(motion):
    words = [name.replace("_", "-") for name, _ in methods.methods() if name != "move"]
    words += [name for _, name, _ in methods.presets()]
    found = [parameter("method", options()["method"]["help"], {"type": "string", "enum": words})] if not motion else []
    found += method_parameters(motion)
    for name, of in options().items():
        if "help" not in of or name in NO_PARAMETERS or "of" in of or name == "method":
            continue
        if of.get("move") and not motion or motion and not of.get("move") and name not in (*OF_BOTH, "iterations"):
            continue
        text = of["move_help"] if motion and "move_help" in of else of["help"]
        if name == "iterations":
            text += f" [{iterations(motion)}]"
        several = "of one element type or metric, or several separated by commas" if name in LISTS else ""
        found.append(parameter(name.replace("_", "-"), text + (f"; {several}" if several else ""), schema_of(of),
                               several=name == "periodic"))
    found += [
        parameter("fixed-set", "Nodes to fix, by name; may be repeated", {"type": "string"}, several=True),
        parameter("precision", "Precision of coordinates in transfer, computation and output",
                  {"type": "string", "enum": ["f32", "f64"]}),
        FORMAT,
        parameter("to", "Format of the result, by its extension [the mesh's]", {"type": "string"})]
    if motion:
        found += [
            parameter("prescribed-set", "Prescribed nodes, by name; may be repeated [the boundary]", {"type": "string"}, several=True),
            parameter("partial", "on: a motion that is reached in part is a result; off: it is refused", SWITCH)]
    return sorted(found, key=lambda of: of["name"])


FORMAT = parameter("format", "Format of the mesh, by its extension [by the name of its file]", {"type": "string"})
FILE_SCHEMA = {"type": "string", "format": "binary"}
PROBLEM = {"description": "Refused; the reasons are those of docs/protocol.md",
           "content": {"application/problem+json": {"schema": {"$ref": "#/components/schemas/Problem"}}}}
PREFER = {"name": "Prefer", "in": "header", "schema": {"type": "string", "enum": ["respond-async"]},
          "description": "respond-async: a job with an address of its own, instead of an answer that waits for its end"}
ACCEPTED = {"description": "A job", "headers": {"Location": {"description": "its address", "schema": {"type": "string"}}},
            "content": {"application/json": {"schema": {"$ref": "#/components/schemas/Job"}}}}


def form(parts):
    return {"required": True, "content": {"multipart/form-data": {"schema": {
        "type": "object", "required": ["mesh"],
        "properties": {name: FILE_SCHEMA | {"description": text} for name, text in parts.items()}}}}}


def answer(text, kind):
    return {"description": text, "content": {kind: {"schema": {"type": "string"} if "json" not in kind else {"type": "object"}}}}


def operation(name, summary, parameters, done, parts=None):
    of = {"operationId": name, "summary": summary, "parameters": parameters}
    if parts:
        of["requestBody"] = form(parts)
    return of | {"responses": {"200": done, "default": PROBLEM}}


def posts():
    mesh = {"mesh": "The mesh file; the extension of its name tells the format, also before .gz"}
    smooth = mesh | {"fixed-nodes": "Nodes to fix: a node index (from 0) per line", "reference": options()["reference"]["help"],
                     "surface": options()["surface"]["help"]}
    move = mesh | {"fixed-nodes": smooth["fixed-nodes"], "to": options()["to"]["help"]}
    binary = answer("The mesh with its nodes moved", "application/octet-stream")
    page = answer("A page that needs nothing else", "text/html")
    metrics = parameter("metrics", "Further metrics, separated by commas, or all", {"type": "string"})
    found = {
        "smooth": operation("smooth", "Smooth a mesh", [*job_parameters(False), PREFER], binary, smooth),
        "move": operation("move", "Move a mesh to new boundary positions", [*job_parameters(True), PREFER], binary, move),
        "report": operation("report", "Smooth a mesh, and show what became of it", job_parameters(False), page, smooth),
        "quality": operation("quality", "Evaluate a mesh", [FORMAT, metrics],
                             answer("meshsmooth.v1.QualityStats in proto3 JSON", "application/json"), mesh)}
    for name in ("smooth", "move"):
        found[name]["responses"]["202"] = ACCEPTED
    return {f"/v1/{name}": {"post": of} for name, of in found.items()}


def gets():
    job = {"description": "The job", "content": {"application/json": {"schema": {"$ref": "#/components/schemas/Job"}}}}
    name = {"name": "job", "in": "path", "required": True, "schema": {"type": "string"}}

    def get(path, summary, done, parameters=()):
        return {"get": operation(path.strip("/").replace("/", "-") or "page", summary, list(parameters), done)}

    paths = {
        "/": get("/", "A page to smooth a file by hand", answer("The page", "text/html")),
        "/healthz": get("/healthz", "Whether the gateway runs", answer("It does", "text/plain")),
        "/readyz": get("/readyz", "Whether the server behind it serves", answer("It does", "text/plain")),
        "/openapi.json": get("/openapi.json", "This document", answer("It", "application/json")),
        "/v1/jobs/{job}": get("job", "A job", job, [name]),
        "/v1/jobs/{job}/events": get("job-events", "Progress until the end, as server-sent events",
                                     answer("Events progress, at last end", "text/event-stream"), [name]),
        "/v1/jobs/{job}/result": get("job-result", "The mesh of a job that is done",
                                     answer("The mesh", "application/octet-stream"), [name]),
        "/v1/jobs/{job}/report": get("job-report", "The report of a job that is done", answer("A page", "text/html"), [name]),
        "/v1/jobs/{job}/summary": get("job-summary", "meshsmooth.v1.Summary of a job that is done",
                                      answer("The summary", "application/json"), [name])}
    paths["/v1/jobs/{job}"]["delete"] = {
        "operationId": "delete-job", "summary": "Cancel a job that runs, remove one that has ended", "parameters": [name],
        "responses": {"204": {"description": "It is on its way to end, or gone"}, "default": PROBLEM}}
    return paths


def document():
    return json.dumps({
        "openapi": "3.1.0",
        "info": {"title": "meshsmooth-gateway", "version": "v1", "summary": "Smooths finite-element meshes",
                 "license": {"name": "Apache-2.0", "identifier": "Apache-2.0"}},
        "paths": gets() | posts(),
        "security": [{}, {"token": []}],
        "components": {
            "securitySchemes": {"token": {"type": "http", "scheme": "bearer"}},
            "schemas": {
                "Problem": {"type": "object", "required": ["type", "title", "status"], "properties": {
                    "type": {"type": "string"}, "title": {"type": "string"}, "status": {"type": "integer"},
                    "detail": {"type": "string"}, "reason": {"type": "string"}, "hint": {"type": "string"},
                    "details": {"type": "object", "additionalProperties": {"type": "string"}}}},
                "Job": {"type": "object", "required": ["id", "state"], "properties": {
                    "id": {"type": "string"},
                    "state": {"type": "string", "enum": ["waiting", "running", "done", "failed", "cancelled"]},
                    "progress": {"type": "object"}, "problem": {"$ref": "#/components/schemas/Problem"}}}}},
    }, indent=1, ensure_ascii=False) + "\n"


FILES = {FILE: document}
