"""The Helm chart rendered, and what comes out held to the fields that Kubernetes knows.

Neither helm nor a cluster's API is in Debian 12 (kubectl --dry-run=client asks a cluster, too), so the few template actions that
the chart uses are carried out here, and any other is a fault: {{ .Path }}, {{ . }}, | quote, toYaml … | nindent N, if (not,
or), range, end, include of another file | sha256sum.
"""
import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

import yaml

import containerfile
import secure

CHART = pathlib.Path(__file__).resolve().parents[2] / "deploy/helm/strata"
INCLUDE = re.compile(r'include \(print \$\.Template\.BasePath "/([\w.]+)"\) \.')
ACTION = re.compile(r"(\s*)\{\{(-?)\s*(.*?)\s*\}\}", re.S)


def tokens(text):
    """Text and actions in turn; "-" takes the white space before an action."""
    at = 0
    for found in ACTION.finditer(text):
        before, trims, action = found.groups()
        yield "text", text[at:found.start()] + ("" if trims else before)
        yield "action", action
        at = found.end()
    yield "text", text[at:]


class Template:
    """The actions of one file."""

    def __init__(self, text, scope):
        self.parts = list(tokens(text))
        self.scope = scope

    def value(self, path, dot):
        if path == ".":
            return dot
        value = self.scope
        for name in path.lstrip(".").split("."):
            if name not in value:
                raise KeyError(f"{path}: values.yaml has no {name}")
            value = value[name]
        return value

    def piped(self, action, dot):
        """What {{ A | B | C }} writes."""
        first, *filters = [part.strip() for part in action.split("|")]
        if first.startswith("toYaml "):
            value = yaml.safe_dump(self.value(first.split()[1], dot), default_flow_style=False).rstrip("\n")
        elif included := INCLUDE.fullmatch(first):
            value = Template((CHART / "templates" / included[1]).read_text(), self.scope).render()[0]
        else:
            assert re.fullmatch(r"\.[\w.]*", first), f"action {{{{ {action} }}}} is not one that this test knows"
            value = self.value(first, dot)
        for name in filters:
            if name == "quote":
                value = json.dumps(str(value))
            elif name == "sha256sum":
                value = hashlib.sha256(value.encode()).hexdigest()
            elif match := re.fullmatch(r"nindent (\d+)", name):
                value = "".join("\n" + " " * int(match[1]) + line for line in str(value).split("\n"))
            else:
                raise AssertionError(f"filter {name} is not one that this test knows")
        return str(value)

    def holds(self, condition, dot):
        """PATH, not PATH, or CONDITION CONDITION …"""
        if condition.startswith("or "):
            return any([self.holds(part.strip("()"), dot) for part in re.findall(r"\([^()]*\)|[^\s()]+", condition)[1:]])
        words = condition.split()
        assert words[:-1] in ([], ["not"]), f"condition {condition} is not one that this test knows"
        return bool(self.value(words[-1], dot)) != bool(words[:-1])

    def render(self, begin=0, dot=None, quiet=False):
        """Up to the end of the file, or `else` or `end`; the text, where that is, and which."""
        out, at = [], begin
        while at < len(self.parts):
            kind, part = self.parts[at]
            if kind == "text":
                out.append(part)
            elif part in ("else", "end"):
                return "".join(out), at, part
            elif part.startswith("if ") or part.startswith("range "):
                text, at = self.block(part, at, dot, quiet)
                out.append(text)
            elif not quiet:
                out.append(self.piped(part, dot))
            at += 1
        return "".join(out), at, None

    def block(self, action, at, dot, quiet):
        """An if or a range with all it holds: its text, and where its end is."""
        word, _, rest = action.partition(" ")
        if word == "range":
            value = None if quiet else self.value(rest, dot)
            texts = [self.render(at + 1, item)[0] for item in value or ()]
            _, end, _ = self.render(at + 1, dot, quiet=True)
            return "".join(texts), end
        holds = not quiet and self.holds(rest, dot)
        text, end, which = self.render(at + 1, dot, quiet or not holds)
        other = ""
        if which == "else":
            other, end, _ = self.render(end + 1, dot, quiet or holds)
        return text if holds else other, end


def merged(values, changes):
    return {**values, **{key: merged(values[key], change) if isinstance(change, dict) and isinstance(values.get(key), dict) else change
                         for key, change in changes.items()}}


def rendered(**changes):
    """All documents of the chart, by kind."""
    values = merged(yaml.safe_load((CHART / "values.yaml").read_text()), changes)
    scope = {"Values": values, "Release": {"Name": "maps", "Namespace": "robots"}}
    documents = [document for path in sorted((CHART / "templates").glob("*.yaml"))
                 for document in yaml.safe_load_all(Template(path.read_text(), scope).render()[0]) if document]
    return {document["kind"]: document for document in documents}


# Fields that Kubernetes' API has, as far as the chart uses them: name: fields below, or None for anything.
ENV = {"name": None, "value": None, "valueFrom": {"secretKeyRef": {"name": None, "key": None}}}
PROBE = {"tcpSocket": {"port": None}, "grpc": {"port": None, "service": None}, "periodSeconds": None, "timeoutSeconds": None,
         "failureThreshold": None}
META = {"name": None, "labels": None, "annotations": None}
CLAIM = {"accessModes": None, "storageClassName": None, "resources": {"requests": None}}
POD = {
    "terminationGracePeriodSeconds": None, "automountServiceAccountToken": None, "restartPolicy": None,
    "securityContext": {"runAsNonRoot": None, "runAsUser": None, "runAsGroup": None, "fsGroup": None,
                        "fsGroupChangePolicy": None, "seccompProfile": {"type": None}},
    "containers": {"name": None, "image": None, "imagePullPolicy": None, "command": None, "args": None, "env": ENV,
                   "ports": {"name": None, "containerPort": None}, "startupProbe": PROBE, "livenessProbe": PROBE,
                   "readinessProbe": PROBE, "resources": {"requests": None, "limits": None},
                   "securityContext": {"allowPrivilegeEscalation": None, "readOnlyRootFilesystem": None,
                                       "capabilities": {"drop": None}},
                   "volumeMounts": {"name": None, "mountPath": None, "subPath": None}},
    "volumes": {"name": None, "emptyDir": None, "configMap": {"name": None}, "persistentVolumeClaim": {"claimName": None},
                "secret": {"secretName": None, "defaultMode": None, "items": {"key": None, "path": None}}},
}
SPECS = {
    ("v1", "ConfigMap"): {"data": None},
    ("v1", "Service"): {"spec": {"type": None, "selector": None, "ports": {"name": None, "port": None, "targetPort": None}}},
    ("v1", "PersistentVolumeClaim"): {"spec": CLAIM},
    ("apps/v1", "StatefulSet"): {"spec": {"replicas": None, "serviceName": None, "selector": {"matchLabels": None},
                                          "template": {"metadata": META, "spec": POD},
                                          "volumeClaimTemplates": {"metadata": META, "spec": CLAIM}}},
    ("batch/v1", "CronJob"): {"spec": {"schedule": None, "concurrencyPolicy": None, "jobTemplate": {"spec": {
        "backoffLimit": None, "template": {"spec": POD}}}}},
}


def strangers(value, known, path=""):
    """Paths of fields that are not known."""
    if known is None:
        return []
    if isinstance(value, list):
        return [fault for item in value for fault in strangers(item, known, path)]
    return [fault for name, below in value.items()
            for fault in (strangers(below, known[name], f"{path}.{name}") if name in known else [f"{path}.{name}"])]


EVERYTHING = {"tlsSecret": "tls", "tokensSecret": "tokens", "web": {"names": ["maps.example.org", "maps"]},
              "storage": {"className": "fast"}, "backup": {"enabled": True, "tokenSecret": "backup"}}


class ChartTest(unittest.TestCase):
    def test_every_field_is_one_of_kubernetes(self):
        for changes in ({}, EVERYTHING, {**EVERYTHING, "metrics": {"open": True}}, {"web": {"enabled": False}, "backup": {"enabled": True}}):
            for kind, document in rendered(**changes).items():
                known = {"apiVersion": None, "kind": None, "metadata": META, **SPECS[document["apiVersion"], kind]}
                self.assertEqual(strangers(document, known, kind), [])
        self.assertEqual(strangers({"spec": {"replica": 1}}, {"spec": {"replicas": None}}), [".spec.replica"])

    def test_what_refers_to_something_finds_it(self):
        for changes in ({}, EVERYTHING):
            made = rendered(**changes)
            pod = made["StatefulSet"]["spec"]["template"]
            volumes = {volume["name"] for volume in pod["spec"]["volumes"]} | {
                claim["metadata"]["name"] for claim in made["StatefulSet"]["spec"]["volumeClaimTemplates"]}
            container, = pod["spec"]["containers"]
            self.assertEqual({mount["name"] for mount in container["volumeMounts"]}, volumes)
            ports = {port["name"] for port in container["ports"]}
            for port in made["Service"]["spec"]["ports"]:
                self.assertIn(port["targetPort"], ports)
            for selector in (made["Service"]["spec"]["selector"], made["StatefulSet"]["spec"]["selector"]["matchLabels"]):
                self.assertLessEqual(selector.items(), pod["metadata"]["labels"].items())
            self.assertEqual(made["StatefulSet"]["spec"]["serviceName"], made["Service"]["metadata"]["name"])
            if "CronJob" in made:
                job = made["CronJob"]["spec"]["jobTemplate"]["spec"]["template"]["spec"]
                self.assertEqual({mount["name"] for mount in job["containers"][0]["volumeMounts"]},
                                 {volume["name"] for volume in job["volumes"]})
                self.assertEqual(job["volumes"][0]["persistentVolumeClaim"]["claimName"],
                                 made["PersistentVolumeClaim"]["metadata"]["name"])

    def test_the_image_has_the_user_and_the_command(self):
        made = rendered(**EVERYTHING)
        image = (CHART.parents[1] / "container/Containerfile").read_text()
        user = made["StatefulSet"]["spec"]["template"]["spec"]["securityContext"]["runAsUser"]
        self.assertIn(f"--uid {user} ", image)
        self.assertIn(f"--gid {user} ", image)
        job = made["CronJob"]["spec"]["jobTemplate"]["spec"]["template"]["spec"]
        program = pathlib.PurePath(job["containers"][0]["command"][0])
        self.assertRegex((CHART.parents[1] / "packages.cmake").read_text(),
                         rf"PROGRAMS backup/{program.name}\n\s*DESTINATION {program.parent}\n")

    def test_stratad_takes_the_configuration(self):
        """`stratad check` on the rendered file and arguments, with the paths of the pod moved into a folder."""
        for changes in ({}, {"web": {"names": ["maps.example.org"]}}, {"web": {"enabled": False}}, {"config": "cache = 320\nqueue = 32\n"}):
            made = rendered(**changes)
            with tempfile.TemporaryDirectory() as folder:
                config = pathlib.Path(folder) / "stratad.conf"
                config.write_text(made["ConfigMap"]["data"]["stratad.conf"].replace("/var/lib/strata", folder))
                container, = made["StatefulSet"]["spec"]["template"]["spec"]["containers"]
                checked = containerfile.check(container.get("args", []), config)
                self.assertEqual(checked.returncode, 0, checked.stdout + checked.stderr)

    def test_a_changed_configuration_restarts_the_pod(self):
        def pod(**changes):
            return rendered(**changes)["StatefulSet"]["spec"]["template"]
        self.assertNotEqual(pod(), pod(config="cache = 320\n"))
        self.assertEqual(pod(), pod(backup={"keep": 3}))

    def test_the_backup_has_the_authority_of_a_certificate(self):
        """A Secret of type kubernetes.io/tls has tls.crt and tls.key, and ca.crt only by who adds it."""
        for backup, secret in (({}, "tls"), ({"caSecret": "authority"}, "authority")):
            made = rendered(tlsSecret="tls", backup={"enabled": True, **backup})
            job = made["CronJob"]["spec"]["jobTemplate"]["spec"]["template"]["spec"]
            container, = job["containers"]
            settings = {entry["name"]: entry["value"] for entry in container["env"]}
            mount, = (mount for mount in container["volumeMounts"] if mount["name"] == "ca")
            volume, = (volume for volume in job["volumes"] if volume["name"] == "ca")
            item, = volume["secret"]["items"]
            self.assertEqual(volume["secret"]["secretName"], secret)
            self.assertEqual(settings["STRATA_BACKUP_OPTIONS"], f"--tls-ca {mount['mountPath']}/{item['path']}")
            host = settings["STRATA_SERVER"].partition(":")[0]
            self.assertEqual(host, made["Service"]["metadata"]["name"])
            values = (CHART / "values.yaml").read_text()
            for said in (f"key `{item['key']}`", "DNS:" + host.replace("maps", "RELEASE")):
                self.assertIn(said, values)

    def test_stratad_takes_the_configuration_with_secrets(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            key, certificate = secure.certificate(folder, secure.authority(folder, "ca"), "tls")
            tokens = folder / "tokens"
            subprocess.run([os.environ["STRATA_STRATAD"], "token", "add", "--tokens", tokens, "robot", "--right", "read", "--all-maps"],
                           check=True, capture_output=True)
            for is_open in (False, True):
                made = rendered(**EVERYTHING, metrics={"open": is_open})
                text = made["ConfigMap"]["data"]["stratad.conf"]
                for inside, here in (("/var/lib/strata", folder), ("/etc/strata/tls/tls.crt", certificate), ("/etc/strata/tls/tls.key", key),
                                     ("/etc/strata/tokens/tokens", tokens)):
                    self.assertIn(f'"{inside}"', text)
                    text = text.replace(inside, str(here))
                config = folder / "stratad.conf"
                config.write_text(text)
                pod = made["StatefulSet"]["spec"]["template"]
                container, = pod["spec"]["containers"]
                checked = containerfile.check(container.get("args", []), config)
                self.assertEqual(checked.returncode, 0, checked.stdout + checked.stderr)
                for told in ("metrics =" in text, "prometheus.io/port" in pod["metadata"]["annotations"],
                             "metrics" in [port["name"] for port in container["ports"]]):
                    self.assertEqual(told, is_open)

    def test_with_tls_and_tokens_nothing_is_insecure(self):
        made = rendered(**EVERYTHING)
        container, = made["StatefulSet"]["spec"]["template"]["spec"]["containers"]
        self.assertNotIn("--insecure", container.get("args", []))
        config = made["ConfigMap"]["data"]["stratad.conf"]
        for line in ('tls-cert = "/etc/strata/tls/tls.crt"', 'tokens = "/etc/strata/tokens/tokens"', 'web-name = "maps.example.org"',
                     'web-name = "maps"', "cache = 160"):
            self.assertIn(line, config.splitlines())
        self.assertIn("--insecure", rendered(tlsSecret="tls")["StatefulSet"]["spec"]["template"]["spec"]["containers"][0]["args"])

    @unittest.skipUnless(shutil.which("helm"), "helm is not here: the templates were carried out by this test alone")
    def test_helm_makes_the_same(self):
        with tempfile.NamedTemporaryFile("w", suffix=".yaml") as values:
            yaml.safe_dump(EVERYTHING, values)
            values.flush()
            told = subprocess.run(["helm", "template", "maps", CHART, "--namespace", "robots", "--values", values.name],
                                  capture_output=True, text=True, check=True).stdout
        by_helm = {document["kind"]: document for document in yaml.safe_load_all(told) if document}
        self.assertEqual(by_helm, rendered(**EVERYTHING))


if __name__ == "__main__":
    unittest.main()
