"""What deploy/ asks Prometheus for is what stratad tells: every metric and label of the alerts and of the board; and the rules, by
promtool's unit tests."""
import json
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest
import urllib.request

import numpy as np
import yaml

import containerfile
import strata
from secure import SecureStratad

DEPLOY = pathlib.Path(__file__).resolve().parents[2] / "deploy"
COMPOSE = DEPLOY / "compose"
ALERT_TESTS = ("alerts_test.yml", "alerts_months_test.yml")
# Of Prometheus itself, and what it adds to every sample.
THEIRS = {"up": {"job", "instance"}}
EVERYWHERE = {"instance", "job", "le"}
WORDS = {"by", "without", "on", "and", "or", "unless", "offset", "sum", "min", "max", "rate", "increase", "delta", "resets",
         "time", "histogram_quantile", "predict_linear", "min_over_time"}
SAMPLE = re.compile(r"^(\w+)(?:\{(.*)\})? \S+$", re.M)


def labels_by_metric(text):
    """What /metrics has."""
    told = {}
    for name, labels in SAMPLE.findall(text):
        told.setdefault(name, set()).update(re.findall(r'(\w+)="', labels))
    return told


def asked(expression):
    """{metric: labels} that an expression of PromQL asks for; the labels of by() for all its metrics, as it has one kind."""
    text = re.sub(r'"[^"]*"', '""', expression)
    groups = {label for group in re.findall(r"\b(?:by|on)\s*\(([^)]*)\)", text) for label in re.findall(r"\w+", group)}
    text = re.sub(r"\b(?:by|on|without)\s*\([^)]*\)", "", text)
    matchers = re.findall(r"\b([a-z_][a-z_0-9]*)\s*\{([^}]*)\}", text)
    found = {name: set() for name in re.findall(r"\b([a-z_]\w*)\b(?!\s*\()", re.sub(r"\{[^}]*\}|\[[^\]]*\]", "", text))
             if name not in WORDS and not re.fullmatch(r"[smhdwy]", name)}
    for name, inside in matchers:
        found.setdefault(name, set()).update(re.findall(r"(\w+)\s*[=!]~?", inside))
    return {name: labels | groups for name, labels in found.items()}


def of_alerts():
    rules = yaml.safe_load((DEPLOY / "alerts.yml").read_text())
    return [(rule["alert"], rule["expr"]) for group in rules["groups"] for rule in group["rules"]]


def of_board():
    board = json.loads((COMPOSE / "grafana/boards/strata.json").read_text())
    targets = [(panel["title"], target["expr"]) for panel in board["panels"] for target in panel.get("targets", [])]
    queries = [variable["query"]["query"] for variable in board["templating"]["list"]]
    return targets + [("variable", re.sub(r"^label_values\((\w+), (\w+)\)$", r'\1{\2=""}', query)) for query in queries]


class MetricsTest(unittest.TestCase):
    """A server with all doors, on which something of each kind has happened."""

    @classmethod
    def setUpClass(cls):
        folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        server = SecureStratad(folder)
        cls.addClassCleanup(server.stop)
        with server.connect() as db:
            world = db.create_map("campus")
            world.upload(np.random.default_rng(1).uniform(-1, 1, (1000, 3)))
            world.wait()
            world.job("rebuild")
            world.backup(folder / "copy.strata")
            for refused in (lambda: db.map("nowhere"), lambda: world.plan((0, np.nan), (0, 0))):
                try:
                    refused()
                except strata.StrataError:
                    pass
        with strata.connect(server.address, ca=server.ca, token="stranger", patience=0) as db:
            try:
                db.maps()
            except strata.Unauthenticated:
                pass
        with urllib.request.urlopen(server.metrics_url) as answer:
            cls.told = {**labels_by_metric(answer.read().decode()), **THEIRS}

    def check_expression(self, where, expression):
        wanted = asked(expression)
        self.assertTrue(wanted, f"{where}: {expression}")
        for metric, labels in wanted.items():
            self.assertIn(metric, self.told, f"{where} asks for {metric}, which stratad does not tell")
            self.assertLessEqual(labels, self.told[metric] | EVERYWHERE, f"{where} asks {metric} for labels that it has not")

    def test_alerts_ask_for_what_there_is(self):
        alerts = of_alerts()
        self.assertGreater(len(alerts), 15)
        for where, expression in alerts:
            self.check_expression(where, expression)

    def test_the_board_asks_for_what_there_is(self):
        board = of_board()
        self.assertGreater(len(board), 25)
        for where, expression in board:
            self.check_expression(where, expression)

    def test_what_there_is_not_would_be_noticed(self):
        for expression in ("rate(strata_sadness_total[5m]) > 0", 'strata_ready{colour="red"} == 0',
                           "sum by (colour) (rate(strata_calls_total[5m]))"):
            with self.assertRaises(AssertionError):
                self.check_expression("test", expression)

    def test_every_alert_has_a_page(self):
        runbook = (DEPLOY / "RUNBOOK.md").read_text()
        for alert, _ in of_alerts():
            self.assertRegex(runbook, rf"(?m)^## .*\b{alert}\b")


class ComposeTest(unittest.TestCase):
    def test_files_that_are_mounted_are_there_and_are_yaml(self):
        compose = yaml.safe_load((COMPOSE / "compose.yml").read_text())
        self.assertEqual(set(compose["services"]), {"stratad", "prometheus", "grafana"})
        for name, service in compose["services"].items():
            for volume in service["volumes"]:
                source = volume.split(":")[0]
                if source.startswith("."):
                    self.assertTrue((COMPOSE / source).exists(), f"{name} mounts {source}")
                else:
                    self.assertIn(source, compose["volumes"])
            for port in service["ports"]:
                self.assertTrue(port.startswith("127.0.0.1:"), f"{name} listens beyond this machine: {port}")
        build = compose["services"]["stratad"]["build"]
        self.assertTrue((COMPOSE / build["context"] / build["dockerfile"]).exists())
        for file in COMPOSE.rglob("*.yml"):
            yaml.safe_load(file.read_text())

    def test_stratad_takes_its_options(self):
        command = yaml.safe_load((COMPOSE / "compose.yml").read_text())["services"]["stratad"]["command"]
        with tempfile.TemporaryDirectory() as folder:
            config = pathlib.Path(folder) / "stratad.conf"
            config.write_text((DEPLOY / "stratad.conf").read_text().replace("/var/lib/strata", folder))
            checked = containerfile.check(command, config)
        self.assertEqual(checked.returncode, 0, checked.stdout + checked.stderr)

    def test_the_image_has_the_viewer(self):
        """Its target is there where cmake found node and npm, and packages take along what was built before them."""
        build = containerfile.CONTAINERFILE.read_text()
        steps = [build.index(step) for step in ("nodejs npm", "cmake --preset release", "--target viewer", "cpack")]
        self.assertEqual(steps, sorted(steps))

    def test_prometheus_scrapes_what_stratad_opens(self):
        compose = yaml.safe_load((COMPOSE / "compose.yml").read_text())
        config = yaml.safe_load((COMPOSE / "prometheus.yml").read_text())
        job, = config["scrape_configs"]
        self.assertEqual(job["job_name"], "stratad")  # the alerts' job
        command = compose["services"]["stratad"]["command"]
        self.assertEqual(job["static_configs"][0]["targets"],
                         [f"stratad:{command[command.index('--metrics') + 1].rpartition(':')[2]}"])


@unittest.skipUnless(shutil.which("promtool"), "promtool is not here: apt install prometheus")
class PromtoolTest(unittest.TestCase):
    def promtool(self, *arguments, folder=DEPLOY):
        told = subprocess.run(["promtool", *arguments], cwd=folder, capture_output=True, text=True, check=False)
        self.assertEqual(told.returncode, 0, told.stdout + told.stderr)

    def test_rules_are_rules(self):
        self.promtool("check", "rules", "alerts.yml")

    def test_alerts_fire_on_what_they_are_for_and_on_nothing_else(self):
        self.promtool("test", "rules", *ALERT_TESTS)

    def test_each_alert_is_seen_to_fire_and_to_be_silent(self):
        cases = [case for file in ALERT_TESTS for case in yaml.safe_load((DEPLOY / file).read_text())["tests"]]
        tests = [test for case in cases for test in case["alert_rule_test"]]
        for alert, _ in of_alerts():
            fired = [bool(test.get("exp_alerts")) for test in tests if test["alertname"] == alert]
            self.assertEqual(set(fired), {True, False}, alert)

    def test_the_compose_files_prometheus_starts(self):
        with tempfile.TemporaryDirectory() as folder:
            for file in (COMPOSE / "prometheus.yml", DEPLOY / "alerts.yml"):
                shutil.copy(file, folder)
            self.promtool("check", "config", "prometheus.yml", folder=folder)


if __name__ == "__main__":
    unittest.main()
