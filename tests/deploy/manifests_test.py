"""What lies in deploy/ and docker/ fits together, and fits the programs: every overlay renders and
is what Kubernetes takes, and every port, flag, environment name, metric and version in there is
one that the built programs have."""

import base64
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from programs import ServerProgram
from test_main import main

ROOT = Path(__file__).parents[2]
DEPLOY = ROOT / "deploy"
KUBERNETES = DEPLOY / "kubernetes"
SERVER = os.environ["MESHSMOOTH_SERVER"]
CLI = os.environ["MESHSMOOTH_CLI"]
OVERLAYS = ("cpu", "cuda", "mtls", "anonymous")
KUBERNETES_VERSIONS = ("1.27", "1.31", "1.37")
EXPECTED_KINDS = {"Namespace", "Deployment", "Service", "PodDisruptionBudget", "NetworkPolicy",
                  "ConfigMap", "ScaledObject", "ServiceMonitor", "PrometheusRule"}

try:
    import yaml
except ImportError:
    yaml = None
try:
    import kubernetes_validate
except ImportError:
    kubernetes_validate = None


def needs(what, where_from):
    """Skips without it, and says so."""
    if what is not None:
        return lambda test: test
    print(f"WARNING: {where_from} is not there: tests of deploy/ are SKIPPED", file=sys.stderr)
    return unittest.skip(f"{where_from} is not there")


needs_yaml = needs(yaml, "PyYAML")
needs_promtool = needs(shutil.which("promtool"), "promtool (apt-get install prometheus)")


def kubectl():
    """One whose kustomize knows components."""
    program = shutil.which("kubectl")
    if program is None:
        return None
    text = subprocess.run([program, "version", "--client", "-o", "json"], capture_output=True,
                          text=True, timeout=60).stdout
    minor = re.search(r'"minor": "(\d+)', text)
    return program if minor and int(minor.group(1)) >= 21 else None


needs_kubectl = needs(kubectl(), "kubectl 1.21 or newer")


def run(*command, **options):
    result = subprocess.run([str(part) for part in command], capture_output=True, text=True,
                            timeout=60, **options)
    if result.returncode != 0:
        raise AssertionError(f"{command}: exit code {result.returncode}\n{result.stdout}{result.stderr}")
    return result.stdout


def render(overlay):
    return list(yaml.safe_load_all(run(kubectl(), "kustomize", KUBERNETES / "overlays" / overlay)))


def of_kind(objects, kind):
    found = [thing for thing in objects if thing["kind"] == kind]
    assert len(found) == 1, f"{len(found)} of the kind {kind}"
    return found[0]


def load(path):
    return yaml.safe_load((ROOT / path).read_text())


def sources():
    """Every file of deploy/ and docker/ with its text."""
    files = [file for folder in (DEPLOY, ROOT / "docker") for file in sorted(folder.rglob("*"))
             if file.is_file()]
    assert len(files) > 20
    return [(str(file.relative_to(ROOT)), file.read_text()) for file in files]


def settings(*arguments, **environment):
    lines = run(SERVER, "--print-config", *arguments, env={**os.environ, **environment})
    return dict(line.split(" = ", 1) for line in lines.splitlines())


def flags(*command):
    return set(re.findall(r"--[a-z][a-z0-9-]*", run(*command, "--help")))


def image_environment():
    text = (ROOT / "docker/Dockerfile").read_text()
    return dict(re.findall(r"\b(MESHSMOOTH_[A-Z_]*LISTEN)=(\S+)", text))


def image_ports():
    return {int(address.rsplit(":", 1)[1]) for address in image_environment().values()}


def dashboard_expressions():
    text = (KUBERNETES / "components/monitoring/meshsmooth-dashboard.json").read_text()
    return [target["expr"] for panel in json.loads(text)["panels"] for target in panel["targets"]]


@needs_yaml
@needs_kubectl
class Manifests(unittest.TestCase):
    def test_every_overlay_renders_all_kinds_in_one_namespace(self):
        for overlay in OVERLAYS:
            with self.subTest(overlay):
                objects = render(overlay)
                self.assertEqual({thing["kind"] for thing in objects}, EXPECTED_KINDS)
                for thing in objects:
                    if thing["kind"] != "Namespace":
                        self.assertEqual(thing["metadata"]["namespace"], "meshsmooth")

    @needs(kubernetes_validate, "kubernetes-validate (scripts/test installs it from PyPI)")
    def test_they_are_valid_by_the_schemas_of_kubernetes(self):
        checked = 0
        for overlay in OVERLAYS:
            for thing in render(overlay):
                if "." in thing["apiVersion"].split("/")[0].replace(".k8s.io", ""):
                    continue  # of an operator, below
                for version in KUBERNETES_VERSIONS:
                    with self.subTest(overlay=overlay, kind=thing["kind"], version=version):
                        kubernetes_validate.validate(thing, version, strict=True)
                        checked += 1
        self.assertEqual(checked, 7 * len(OVERLAYS) * len(KUBERNETES_VERSIONS))
        wrong = of_kind(render("cpu"), "Deployment")
        wrong["spec"]["replcas"] = 2
        with self.assertRaises(kubernetes_validate.ValidationError):
            kubernetes_validate.validate(wrong, KUBERNETES_VERSIONS[-1], strict=True)

    # Their schemas come with the operators only; so much of them is written down here.
    def test_what_is_the_operators_has_no_unknown_fields(self):
        known = {
            "ServiceMonitor": {"jobLabel", "selector", "endpoints"},
            "PrometheusRule": {"groups"},
            "ScaledObject": {"scaleTargetRef", "minReplicaCount", "maxReplicaCount",
                             "pollingInterval", "fallback", "advanced", "triggers"},
        }
        objects = render("cpu")
        for kind, fields in known.items():
            self.assertLessEqual(set(of_kind(objects, kind)["spec"]), fields, kind)
        monitor = of_kind(objects, "ServiceMonitor")["spec"]
        service = of_kind(objects, "Service")
        labels = service["metadata"]["labels"]
        self.assertLessEqual(monitor["selector"]["matchLabels"].items(), labels.items())
        self.assertEqual(labels[monitor["jobLabel"]], "meshsmooth")  # up{job="meshsmooth"}
        self.assertIn(monitor["endpoints"][0]["port"],
                      [port["name"] for port in service["spec"]["ports"]])
        deployment = of_kind(objects, "Deployment")["metadata"]
        scaled = of_kind(objects, "ScaledObject")["spec"]
        self.assertEqual(scaled["scaleTargetRef"]["name"], deployment["name"])

    def test_pods_are_locked_down(self):
        for overlay in OVERLAYS:
            pod = of_kind(render(overlay), "Deployment")["spec"]["template"]["spec"]
            self.assertTrue(pod["securityContext"]["runAsNonRoot"])
            self.assertFalse(pod["automountServiceAccountToken"])
            container, = pod["containers"]
            self.assertEqual(container["securityContext"],
                             {"allowPrivilegeEscalation": False, "readOnlyRootFilesystem": True,
                              "capabilities": {"drop": ["ALL"]}})
            for limited in ("cpu", "memory", "ephemeral-storage"):
                self.assertIn(limited, container["resources"]["limits"])
            self.assertEqual("nvidia.com/gpu" in container["resources"]["limits"],
                             overlay == "cuda")

    def test_the_server_takes_the_settings_of_every_overlay(self):
        for overlay in OVERLAYS:
            with self.subTest(overlay), tempfile.TemporaryDirectory() as folder:
                objects = render(overlay)
                pod = of_kind(objects, "Deployment")["spec"]["template"]["spec"]
                container, = pod["containers"]
                config, = (thing for thing in objects if thing["kind"] == "ConfigMap"
                           and "server.toml" in thing["data"])
                self.assertIn({"name": config["metadata"]["name"]},
                              [volume.get("configMap") for volume in pod["volumes"]])
                file = Path(folder) / "server.toml"
                file.write_text(config["data"]["server.toml"])
                arguments = [str(file) if part == "/etc/meshsmooth/server.toml" else part
                             for part in container["args"]]
                self.assertIn(str(file), arguments)
                taken = settings(*arguments, **{variable["name"]: variable["value"]
                                                for variable in container.get("env", [])})
                anonymous = overlay == "anonymous"
                self.assertEqual(taken["insecure"], "true" if anonymous else "false")
                self.assertEqual(taken["tls-cert"] == '""', anonymous)
                self.assertEqual(taken["tls-client-ca"] != '""', overlay == "mtls")
                self.assertEqual(taken["token-file"] != '""', overlay in ("cpu", "cuda"))
                if overlay == "cuda":
                    self.assertEqual(taken["backend"], '"cuda"')

                ports = {port["name"]: port["containerPort"] for port in container["ports"]}
                self.assertEqual(taken["listen"], f'"0.0.0.0:{ports["grpc"]}"')
                self.assertEqual(taken["admin-listen"], f'"0.0.0.0:{ports["admin"]}"')
                for probe in ("startupProbe", "readinessProbe", "livenessProbe"):
                    self.assertEqual(container[probe]["httpGet"]["port"], "admin")
                for port in of_kind(objects, "Service")["spec"]["ports"]:
                    self.assertEqual(port["port"], ports[port["targetPort"]])
                drain = float(taken["lame-duck-seconds"]) + float(taken["drain-grace-seconds"]) + 2
                self.assertGreater(pod["terminationGracePeriodSeconds"], drain)
                # Endpoints must learn of a drain while calls are still accepted.
                probe = container["readinessProbe"]
                self.assertLess(probe["periodSeconds"] * probe["failureThreshold"],
                                float(taken["lame-duck-seconds"]))

    def test_the_images_are_of_this_version(self):
        text = (ROOT / "CMakeLists.txt").read_text()
        version = re.search(r"project\(meshsmooth VERSION ([0-9.]+)", text).group(1)
        for overlay in OVERLAYS:
            image = (of_kind(render(overlay), "Deployment")
                     ["spec"]["template"]["spec"]["containers"][0]["image"])
            tag = version + ("-cuda" if overlay == "cuda" else "")
            self.assertEqual(image, f"meshsmooth-server:{tag}")
        image = load("docker/compose.yaml")["services"]["meshsmooth-server"]["image"]
        self.assertEqual(image, "${MESHSMOOTH_IMAGE:-meshsmooth-server:" + version + "}")


@needs_yaml
@needs(shutil.which("openssl"), "openssl")
class Credentials(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name) / "new"
        run(KUBERNETES / "make-credentials", self.folder, "mesher", "solver")
        self.secrets = {secret["metadata"]["name"]: {
            file: base64.b64decode(data) for file, data in secret["data"].items()}
            for secret in yaml.safe_load_all((self.folder / "secrets.yaml").read_text())}

    @needs_kubectl
    def test_they_are_what_the_pods_mount(self):
        for overlay in "cpu", "cuda":
            pod = of_kind(render(overlay), "Deployment")["spec"]["template"]["spec"]
            container, = pod["containers"]
            secrets = {volume["name"]: volume["secret"]["secretName"]
                       for volume in pod["volumes"] if "secret" in volume}
            files = {f'{mount["mountPath"]}/{file}' for mount in container["volumeMounts"]
                     if mount["name"] in secrets for file in self.secrets[secrets[mount["name"]]]}
            self.assertEqual(files, {variable["value"] for variable in container["env"]
                                     if variable["value"].startswith("/etc/")})

    def test_a_server_takes_them_and_asks_for_a_token(self):
        for name, data in {**self.secrets["meshsmooth-tls"],
                           **self.secrets["meshsmooth-tokens"]}.items():
            (self.folder / name).write_bytes(data)
        server = ServerProgram("--backend", "cpu", "--tls-cert", self.folder / "tls.crt",
                               "--tls-key", self.folder / "tls.key",
                               "--token-file", self.folder / "tokens")
        self.addCleanup(server.kill)
        call = (CLI, "info", "--server", server.address, "--tls-ca", self.folder / "ca.crt",
                "--tls-server-name", "meshsmooth.meshsmooth.svc.cluster.local")
        for caller in "mesher", "solver":
            run(*call, "--token-file", self.folder / f"{caller}.token")
        with self.assertRaisesRegex(AssertionError, "TOKEN_MISSING"):
            run(*call)

    def test_nothing_is_overwritten_and_no_secret_is_for_others(self):
        with self.assertRaisesRegex(AssertionError, "exists"):
            run(KUBERNETES / "make-credentials", self.folder)
        for file in self.folder.iterdir():
            self.assertEqual(file.stat().st_mode & 0o077, 0, file)
        secrets = (self.folder / "secrets.yaml").read_bytes() + b"".join(
            self.secrets["meshsmooth-tokens"].values())
        self.assertNotIn((self.folder / "mesher.token").read_bytes().strip(), secrets)


class Rules(unittest.TestCase):
    def test_the_rules_of_the_operator_are_those_of_prometheus(self):
        with tempfile.TemporaryDirectory() as folder:
            made = Path(folder) / "rule.yaml"
            run(KUBERNETES / "generate", made)
            kept = KUBERNETES / "components/monitoring/prometheusrule.yaml"
            self.assertEqual(made.read_text(), kept.read_text(), "run deploy/kubernetes/generate")

    @needs_promtool
    def test_promtool_takes_rules_configuration_and_every_query_of_the_dashboard(self):
        run("promtool", "check", "rules", DEPLOY / "prometheus/meshsmooth.rules.yml")
        with tempfile.TemporaryDirectory() as folder:
            for file in (ROOT / "docker/prometheus.yml", DEPLOY / "prometheus/meshsmooth.rules.yml"):
                shutil.copy(file, folder)
            run("promtool", "check", "config", Path(folder) / "prometheus.yml")
            expressions = dashboard_expressions()
            self.assertGreater(len(expressions), 10)
            rules = [{"record": f"panel:{i}", "expr": text.replace("$__rate_interval", "5m")}
                     for i, text in enumerate(expressions)]
            file = Path(folder) / "dashboard.json"  # JSON is YAML
            file.write_text(json.dumps({"groups": [{"name": "dashboard", "rules": rules}]}))
            run("promtool", "check", "rules", file)

    def test_every_metric_is_in_the_documentation(self):
        # ... which server_program_test holds against a scrape.
        documented = set(re.findall(r"\b(?:meshsmooth|process)_[a-z_]+\b",
                                    (ROOT / "docs/operations.md").read_text()))
        texts = dashboard_expressions() + [
            (KUBERNETES / "components/autoscaling/scaledobject.yaml").read_text(),
            (DEPLOY / "prometheus/meshsmooth.rules.yml").read_text()]
        names = {re.sub(r"_(bucket|sum|count)$", "", name) for text in texts
                 for name in re.findall(r"(?<![:\w])(?:meshsmooth|process)_[a-z_]+\b(?!:)", text)}
        self.assertGreater(len(names), 12)
        self.assertEqual(names - documented, set())


class Names(unittest.TestCase):
    """R22."""

    def test_every_environment_name_is_one_that_something_reads(self):
        servers = {"MESHSMOOTH_" + key.upper().replace("-", "_") for key in settings()}
        servers.add("MESHSMOOTH_CONFIG")
        self.assertIn("MESHSMOOTH_ADMIN_LISTEN", servers)
        options = set(re.findall(r"\bMESHSMOOTH_[A-Z_]+\b", "".join(
            file.read_text() for file in (ROOT / "CMakeLists.txt", ROOT / "cmake/cuda.cmake",
                                          ROOT / "server/CMakeLists.txt"))))
        seen = 0
        for name, text in sources():
            known = set(servers)
            # What a file itself takes from the environment: "${NAME-default}" and the like.
            known |= set(re.findall(r"\$\{(MESHSMOOTH_[A-Z_]+):?-", text))
            if name.startswith("docker/"):
                known |= options
            for found in re.findall(r"\bMESHSMOOTH_[A-Z_]+\b", text):
                seen += 1
                self.assertIn(found, known, name)
        self.assertGreater(seen, 10)

    def test_every_flag_is_one_of_the_program(self):
        server, client = flags(SERVER), {}
        for command in ("smooth", "health"):
            client[command] = flags(CLI, command)
        self.assertIn("--print-config", server)
        seen = 0
        for name, text in sources():
            # One command: up to the end of the line or, in a shell, of what goes on.
            text = re.sub(r"\\\n", " ", text)
            for line in text.splitlines():
                found = re.search(r"(meshsmooth-server|\bmeshsmooth\"?,? |\$\{MESHSMOOTH:-meshsmooth\}\" )"
                                  r"(.*)", line)
                if not found or "docker " in line.split("meshsmooth")[0]:
                    continue
                command = re.match(r'["\s]*(smooth|health)\b', found.group(2))
                known = client[command.group(1)] if command else server
                for flag in re.findall(r"(?<![\w-])--[a-z][a-z-]*", found.group(2)):
                    seen += 1
                    self.assertIn(flag, known, f"{name}: {line}")
        self.assertGreater(seen, 5)

    @needs_yaml
    def test_every_port_is_one_that_the_image_listens_on(self):
        ports = image_ports()
        self.assertEqual(len(ports), 2)
        exposed = re.search(r"^EXPOSE (.*)", (ROOT / "docker/Dockerfile").read_text(), re.M).group(1)
        self.assertEqual({int(port) for port in exposed.split()}, ports)
        grpc, admin = (int(image_environment()[name].rsplit(":", 1)[1])
                       for name in ("MESHSMOOTH_LISTEN", "MESHSMOOTH_ADMIN_LISTEN"))
        self.assertIn(f'"127.0.0.1:{grpc}"', (ROOT / "docker/Dockerfile").read_text())

        compose = load("docker/compose.yaml")["services"]
        self.assertTrue(compose["haproxy"]["ports"][0].endswith(f":{grpc}"))
        scrape, = load("docker/prometheus.yml")["scrape_configs"]
        self.assertEqual(scrape["job_name"], "meshsmooth")
        target, = scrape["dns_sd_configs"]
        self.assertEqual(target["port"], admin)
        self.assertIn(target["names"][0], compose)

        cluster, = load("deploy/envoy/envoy.yaml")["static_resources"]["clusters"]
        endpoint = cluster["load_assignment"]["endpoints"][0]["lb_endpoints"][0]["endpoint"]
        self.assertEqual(endpoint["address"]["socket_address"]["port_value"], grpc)
        self.assertEqual(endpoint["health_check_config"]["port_value"], admin)
        self.assertIn(endpoint["address"]["socket_address"]["address"], compose)

    @needs_yaml
    def test_composed_containers_are_locked_down_and_wait_for_the_drain(self):
        compose = load("docker/compose.yaml")["services"]
        for name in ("meshsmooth-server", "haproxy", "prometheus"):
            self.assertTrue(compose[name]["read_only"], name)
            self.assertEqual(compose[name]["cap_drop"], ["ALL"], name)
        server = compose["meshsmooth-server"]
        taken = settings(**server["environment"])
        drain = float(taken["lame-duck-seconds"]) + float(taken["drain-grace-seconds"]) + 2
        self.assertGreater(float(server["stop_grace_period"].removesuffix("s")), drain)


class Machines(unittest.TestCase):
    @needs(shutil.which("systemd-analyze"), "systemd-analyze")
    def test_systemd_takes_the_unit(self):
        text = (DEPLOY / "systemd/meshsmooth-server.service").read_text()
        command = "ExecStart=/usr/bin/meshsmooth-server "
        self.assertIn(command, text)
        with tempfile.TemporaryDirectory() as folder:
            unit = Path(folder) / "meshsmooth-server.service"
            unit.write_text(text.replace(command, f"ExecStart={SERVER} "))
            result = subprocess.run(["systemd-analyze", "verify", "--man=no", str(unit)],
                                    capture_output=True, text=True, timeout=60)
            own = [line for line in result.stderr.splitlines() if "meshsmooth" in line]
            self.assertEqual((result.returncode, own), (0, []), result.stderr)
        taken = settings()
        drain = float(taken["lame-duck-seconds"]) + float(taken["drain-grace-seconds"]) + 2
        stop = re.search(r"^TimeoutStopSec=(\d+)$", text, re.M)
        self.assertGreater(float(stop.group(1)), drain)

    def test_an_element_of_a_slurm_array_smooths_its_mesh_once(self):
        with tempfile.TemporaryDirectory() as folder:
            folder = Path(folder)
            meshes = [folder / f"mesh{i}.ply" for i in range(2)]
            for seed, mesh in enumerate(meshes):
                run(CLI, "generate", "square", "--nodes", 500, "--seed", seed + 1, "-o", mesh)
            (folder / "list.txt").write_text("".join(f"{mesh}\n" for mesh in meshes))

            def element(number):
                return subprocess.run(
                    ["bash", DEPLOY / "slurm/smooth.sbatch", folder / "list.txt", folder / "out"],
                    capture_output=True, text=True, timeout=60,
                    env={**os.environ, "SLURM_ARRAY_TASK_ID": str(number), "MESHSMOOTH": CLI})
            result = element(2)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual(sorted(file.name for file in (folder / "out").iterdir()),
                             ["mesh1.json", "mesh1.ply"])
            self.assertIn("convergence", json.loads((folder / "out/mesh1.json").read_text()))
            before = (folder / "out/mesh1.ply").stat().st_mtime_ns
            self.assertEqual(element(2).returncode, 0)
            self.assertEqual((folder / "out/mesh1.ply").stat().st_mtime_ns, before)
            self.assertEqual(element(3).returncode, 2)
            meshes[0].write_text("no mesh")
            self.assertEqual(element(1).returncode, 3)
            self.assertEqual(sorted(file.name for file in (folder / "out").iterdir()),
                             ["mesh1.json", "mesh1.ply"])


if __name__ == "__main__":
    main()
