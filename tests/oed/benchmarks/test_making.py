"""A benchmark is made, answered by the rivals, and scored, as the documentation shows."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from oed.benchmarks import MakeOptions, make_benchmark, read_answers, score_benchmark
from oed.benchmarks.making.strata import SHARES, counts, tasks
from oed.benchmarks.rivals.logs import read_motion
from oed.benchmarks.sealing import unseal
from oed.benchmarks.solving import answer_benchmark
from oed.benchmarks.truth.effects import KNOWN
from robots import load_robot
from robots.common.errors import InputError

TINY = MakeOptions(cases=2, robots=("heavy",), size=0.05, duration=12.0, unseen=10.0)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory):
    """Two cases of 12 s."""
    return make_benchmark(tmp_path_factory.mktemp("made") / "blind", options=TINY, seed=5)


@pytest.mark.slow
def test_public_files_hold_no_answers(made):
    """No public file names a stratum, a formula, a seed or the torque of the unseen motion."""
    truths = unseal(f"{made.folder}.answers", made)
    assert sorted(truth.stratum for truth in truths.values()) == ["nothing", "one"]
    files = [path for path in made.folder.rglob("*") if path.is_file()]
    assert {path.name for path in files} == {
        "benchmark.json",
        "case.json",
        "heavy.urdf",
        "heavy.yaml",
        "log.csv",
        "unseen.csv",
    }
    words = {"seed", "stratum", "salt", *(effect.__name__ for effect in KNOWN)}
    for path in files:
        text = path.read_text()
        assert not words & set(re.findall(r"\w+", text)), path
        if path.name == "case.json":
            assert not {name for truth in truths.values() for name in (e.effect for e in truth.effects)} & set(
                re.findall(r"\w+", text)
            )
    assert (made.folder / "case-001" / "unseen.csv").read_text().splitlines()[0] == "t,q1,q2,q3,q4,q5,q6"


@pytest.mark.slow
def test_cases_are_what_a_user_has(made):
    """The robot's description loads, the log has the stated noise, and the held-back torque fits the unseen motion."""
    for name, truth in unseal(f"{made.folder}.answers", made).items():
        case = made.case(name)
        assert load_robot(case.yaml).n == case.joints == 6
        t, q, tau = read_motion(case.log, 6, torque=True)
        assert len(t) == len(q) == 12 / 0.004
        later, _, none = read_motion(case.unseen, 6, torque=False)
        assert none.shape[1] == 0
        assert later[0] > t[-1]
        np.testing.assert_allclose(truth.torque[:, 0], later)
        assert case.unseen_rows == len(later) == len(truth.torque)
        # The unseen motion has other torques, so its noise is 2.5 % of a level that differs by less than half.
        level = np.sqrt((tau**2).mean(axis=0))
        assert np.all(np.abs(np.log(truth.noise / (0.025 * level))) < 0.4)


@pytest.mark.slow
def test_rivals_answer_and_are_scored(made, tmp_path: Path):
    """Both rivals answer every case with a prediction that is better than none, and get a score each."""
    out = []
    for by in ("residual-fit", "threshold"):
        done = answer_benchmark(made.folder, by=by, out=tmp_path / by)
        assert done.refused == {}
        out.append(tmp_path / by)
        for name, answer in read_answers(tmp_path / by, made).cases.items():
            torque = unseal(f"{made.folder}.answers", made)[name].torque[:, 1:]
            assert answer.torque is not None
            off = np.sqrt(((answer.torque - torque) ** 2).mean(axis=0) / (torque**2).mean(axis=0))
            assert np.median(off) < 0.5
    scores = score_benchmark(made.folder, out)
    assert [tool.tool for tool in scores.tools] == ["residual-fit", "threshold"]
    assert all(tool.missing == () and tool.unpredicted == 0 for tool in scores.tools)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_cases_and_another_seal(tmp_path: Path):
    """Cases repeat with the seed and differ without one. The seal never repeats, because of its salt."""
    one = MakeOptions(cases=1, robots=("heavy",), duration=10.0, unseen=10.0)
    made = [
        make_benchmark(tmp_path / name, options=one, seed=seed, sealed=tmp_path / f"{name}.zip")
        for name, seed in (("first", 5), ("second", 5), ("third", None))
    ]
    logs = [(benchmark.folder / "case-001" / "log.csv").read_bytes() for benchmark in made]
    assert logs[0] == logs[1] != logs[2]
    assert len({benchmark.commitment for benchmark in made}) == 3
    assert len({benchmark.identity for benchmark in made}) == 3


def test_interrupted_answers_go_on(blind, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """A run that ends in the middle keeps its answers, and the same call answers the rest alone."""
    from oed.benchmarks import solving
    from oed.benchmarks.answers import CaseAnswer

    asked = []

    def method(case):
        if len(asked) == 2:
            asked.append(case.name)
            raise KeyboardInterrupt
        asked.append(case.name)
        return CaseAnswer(verdict="nothing", torque=np.ones((case.unseen_rows, case.joints)))

    monkeypatch.setitem(solving.METHODS, "threshold", method)
    with pytest.raises(KeyboardInterrupt):
        answer_benchmark(blind.folder, by="threshold", out=tmp_path / "out", workers=1)
    assert not (tmp_path / "out" / "answers.json").exists()
    done = answer_benchmark(blind.folder, by="threshold", out=tmp_path / "out", workers=1)
    assert asked == ["case-001", "case-002", "case-003", "case-003", "case-004"]
    assert done.resumed == 2
    assert set(read_answers(tmp_path / "out", blind).cases) == set(blind.cases)
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["answers.json", "predictions"]
    with pytest.raises(InputError, match="the file exists"):
        answer_benchmark(blind.folder, by="threshold", out=tmp_path / "out", workers=1)
    with pytest.raises(InputError, match="no method is called 'best'; allowed: oed, residual-fit, threshold"):
        answer_benchmark(blind.folder, by="best", out=tmp_path / "other")


@pytest.mark.parametrize("cases", [1, 2, 7, 24, 40, 100])
def test_strata_have_their_shares(cases: int):
    """Strata add up to the number of cases, and each is within one of its share."""
    found = counts(cases)
    assert sum(found.values()) == cases
    assert all(abs(found[name] - share * cases) <= 1 for name, share in SHARES.items())


def test_effects_and_robots_take_turns():
    """With as many single effects as the plant knows, each is hidden once; order and seeds do not reveal strata."""
    listed = list(tasks(80, ("ur10", "heavy"), np.random.default_rng(1)))
    single = [task.effects[0] for task in listed if task.stratum == "one"]
    assert len(set(single)) == min(len(single), len(KNOWN))
    assert {task.robots for task in listed} == {("ur10", "heavy"), ("heavy", "ur10")}
    strata = [task.stratum for task in listed]
    assert strata != sorted(strata)
    assert len({task.seed for task in listed}) == 80


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"cases": 0}, "0 cases; allowed: 1 or more"),
        ({"robots": ("kuka",)}, "the plant has no robot 'kuka'; allowed: ur10"),
        ({"robots": ()}, "the plant has no robot ''"),
        ({"size": 0.5}, "size 0.5; allowed: 0.001 to 0.2"),
        ({"noise": float("nan")}, "noise nan"),
        ({"duration": 1.0}, "duration 1; allowed: 10 to 3600"),
    ],
)
def test_bad_options(options, message: str):
    """An option out of its range is named, with the range."""
    with pytest.raises(InputError, match=message):
        MakeOptions(**options)


def test_answers_do_not_lie_in_the_public_folder(tmp_path: Path):
    """A sealed file inside the folder that is handed out is refused."""
    with pytest.raises(InputError, match="lies in the public folder"):
        make_benchmark(tmp_path / "blind", options=TINY, sealed=tmp_path / "blind" / "answers.zip")
    assert not (tmp_path / "blind").exists()
