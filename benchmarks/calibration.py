"""Calibrations of geometry: coverage, rank, hidden causes, designed poses, time, and a robot of others.

``python benchmarks/calibration.py arms --draws 200 --robot ur10`` etc. ``tiago FOLDER --urdf FILE`` needs the folder
`examples/tiago/data/calibration/mocap` of thanhndv212/figaroh-examples and a URDF of that robot.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks.calibration_parts import oracle
from benchmarks.calibration_parts.pose_bounds import best_information
from estimation.calibrations import CalibrationOptions, calibrate
from estimation.calibrations.fit import fit_geometry, preference
from robots import load_robot
from robots.geometry_errors import (
    TERMS,
    BodyPoses,
    GeometryModel,
    Markers,
    MeasuredPoses,
    error_term,
    random_positions,
    reduce_columns,
)
from robots.geometry_errors.poses import approaches

NOISE = 5e-5  # m
KINDS = ("joint_zero", "link_placement", "eccentricity", "joint_compliance")
CAUSES = ("zero", "link", "eccentricity", "compliance", "backlash", "loose_marker", "moved_base")
RIGID = ("torso_lift_joint", *(f"arm_{i}_joint" for i in range(1, 8)))


def robot_of(name: str):
    """A catalogue robot, or the SCARA of the oracle."""
    if name != "scara":
        return load_robot(name)
    folder = Path(tempfile.mkdtemp())
    (folder / "scara.urdf").write_text(oracle.SCARA)
    return load_robot(folder / "scara.urdf")


def measured(robot, q, errors, setup, rng, noise=NOISE) -> MeasuredPoses:
    """Poses of the oracle's arm, as a table would hold them."""
    arm = oracle.Arm.of(robot)
    observed = oracle.markers(oracle.flange(arm, q, errors), *setup)
    observed = observed + noise * rng.standard_normal(observed.shape)
    return MeasuredPoses(q=q, measurement=Markers(count=3), observed=observed, approach=approaches(q))


def arms(draws: int, name: str, select: bool, first: int) -> None:
    """Held-out error and coverage of intervals over virtual arms."""
    robot = robot_of(name)
    arm = oracle.Arm.of(robot)
    hits = total = 0
    errors_, ratios, wrong, names = [], [], 0, set()
    for draw in range(first, first + draws):
        rng = np.random.default_rng(draw)
        truth, setup = oracle.usual_errors(arm, rng), oracle.usual_setup(rng)
        poses = measured(robot, random_positions(robot, 40, seed=draw), truth, setup, rng)
        options = CalibrationOptions(kinds=None if select else KINDS, diagnose=False)
        found = calibrate(robot, poses, options=options)
        # What the parameters of this set are without noise: a fit to many exact poses.
        many = measured(robot, random_positions(robot, 300, seed=10_000 + draw), truth, setup, rng, noise=0.0)
        terms = [error_term(kind) for kind in found.kinds]
        exact = fit_geometry(GeometryModel([robot], terms, many), robust=False)
        value = dict(zip((p.name for p in exact.parameters), exact.values, strict=False))
        kept = {exact.parameters[k].name for k in exact.reduction.kept}
        for item in found.errors:
            names.add(item.name)
            if item.name in kept:
                total += 1
                hits += item.lower <= value[item.name] <= item.upper
            else:
                wrong += 1
        other = measured(robot, random_positions(robot, 200, seed=20_000 + draw), truth, setup, rng)
        ours = GeometryModel([robot], terms, other)
        own = {item.name: item.value for item in found.errors}
        fitted = np.array([own.get(item.name, 0.0) for item in ours.errors])
        setup_ = fit_setup(robot, terms, poses, found, fitted)
        residual = ours.residual(fitted, setup_)
        errors_.append(float(np.sqrt(np.mean(residual**2))))
        ratios.append(errors_[-1] / NOISE)
        if (draw + 1) % 10 == 0:
            print(
                f"{name}: draws {first} to {draw}, held out {1e3 * np.median(errors_):.4f} mm per number "
                f"({np.median(ratios):.3f} of the noise, worst {np.max(ratios):.3f}); 95 % intervals hold "
                f"{100 * hits / total:.1f} % of {total} ({hits}); determined but not by exact poses: {wrong}",
                flush=True,
            )


def fit_setup(robot, terms, poses, found, fitted):
    """The setup of a calibration, from its plain lists."""
    model = GeometryModel([robot], terms, poses)
    start = dict(model.start())
    from robots.geometry_errors.measurements.setup import Unknown

    return {
        name: Unknown(kind=part.kind, value=np.array(found.setup[name]), known=part.known)
        for name, part in start.items()
    }


def pinocchio_rank(path: Path, robot, q: np.ndarray) -> tuple[int, int]:
    """Rank of the placements' and the tool's Jacobian by pinocchio: by differences of all joint placements.

    Columns are six per joint placement and six of the base and tool; rows are the pose's position and turn.
    """
    import pinocchio as pin

    full = pin.buildModelFromUrdf(str(path))
    lock = [full.getJointId(name) for name in full.names[1:] if name not in robot.joint_names]
    model = pin.buildReducedModel(full, lock, pin.neutral(full)) if lock else full
    tool = pin.SE3.Random()

    def pose(x: np.ndarray, values: np.ndarray):
        place = pin.exp6(values[:6])
        at = 6
        for joint in range(1, model.njoints):
            jmodel = model.joints[joint]
            jdata = jmodel.createData()
            # The joint's data counts positions of the whole model.
            jmodel.calc(jdata, x)
            place = place * model.jointPlacements[joint] * pin.exp6(values[at : at + 6]) * jdata.M
            at += 6
        return place * tool * pin.exp6(values[at : at + 6])

    columns = 6 * (model.njoints + 1)
    rows = []
    step = 1e-6
    for x in q:
        configuration = []
        for joint in range(1, model.njoints):
            own = float(x[joint - 1])
            configuration += [np.cos(own), np.sin(own)] if model.joints[joint].nq == 2 else [own]
        configuration = np.array(configuration)
        block = np.zeros((6, columns))
        for k in range(columns):
            move = np.zeros(columns)
            move[k] = step
            ahead, behind = pose(configuration, move), pose(configuration, -move)
            block[:, k] = pin.log6(behind.inverse() * ahead).vector / (2.0 * step)
        rows.append(block)
    matrix = np.vstack(rows)
    values = np.linalg.svd(matrix, compute_uv=False)
    return int((values > 1e-6 * values[0]).sum()), columns


def rank(urdfs: list[str]) -> None:
    """Rank of the minimal set against pinocchio's, for robots of the catalogue and of URDF files."""
    catalog = Path(__file__).parents[1] / "robots" / "catalog"
    folder = Path(tempfile.mkdtemp())
    (folder / "scara.urdf").write_text(oracle.SCARA)
    cases = [("ur10", catalog / "ur10.urdf", None), ("panda", catalog / "panda.urdf", None)]
    cases += [("scara", folder / "scara.urdf", None), ("er3a", _as_urdf(load_robot("er3a"), folder), None)]
    cases += [(Path(item.split(":")[0]).stem, Path(item.split(":")[0]), item.split(":")[1:] or None) for item in urdfs]
    for name, path, chosen in cases:
        tip = {"ur10": None, "panda": None}.get(name)
        joints = chosen[0].split(",") if chosen else None
        robot = load_robot(path, tip=tip, joints=joints, unlimited=True) if joints else _load(path)
        q = random_positions(robot, 40, seed=3)
        other, columns = pinocchio_rank(path, robot, q[:, :])
        poses = MeasuredPoses(q=q, measurement=BodyPoses(), observed=np.tile([0, 0, 0, 0, 0, 0, 1.0], (len(q), 1)))
        model = GeometryModel([robot], [error_term("joint_zero"), error_term("link_placement")], poses)
        setup = BodyPoses().example
        parameters = model.parameters(setup)
        scale = np.array([item.scale for item in parameters])
        matrix = (model.evaluate(np.zeros(len(model.errors)), setup).jacobian * scale).reshape(-1, len(scale))
        ours = reduce_columns(matrix, preference(parameters)).rank
        print(
            f"{name}: {robot.n} joints, rank {ours}, pinocchio {other} of {columns}: "
            f"{'equal' if ours == other else 'DIFFERENT'}",
            flush=True,
        )


def _load(path: Path):
    from robots.loading import catalogue

    return load_robot(path.stem if path.stem in catalogue() else path, unlimited=True)


def _as_urdf(robot, folder: Path) -> Path:
    from xml.etree import ElementTree

    from estimation.calibrations.exports.robot_files import _plain_chain

    path = folder / f"{robot.name}.urdf"
    path.write_text(ElementTree.tostring(_plain_chain(robot), encoding="unicode"))
    return path


def hidden(kind: str, seed: int, robots) -> tuple[object, int | None, MeasuredPoses]:
    """An arm with one hidden cause, of a size that matters: robot, joint, poses."""
    rng = np.random.default_rng(seed)
    robot = robots[seed % len(robots)]
    arm = oracle.Arm.of(robot)
    q = random_positions(robot, 60, seed=500 + seed)
    errors, setup = oracle.Errors.none(arm.n), oracle.usual_setup(rng)
    joint = int(rng.integers(1, arm.n - 1))
    sign = rng.choice([-1.0, 1.0])
    if kind == "zero":
        errors.zero[joint] = sign * rng.uniform(1e-3, 5e-3)
    elif kind == "link":
        errors.shift[joint], errors.turn[joint] = 1e-3 * rng.standard_normal(3), 1e-3 * rng.standard_normal(3)
    elif kind == "eccentricity":
        phase, size = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(5e-4, 2e-3)
        errors.sine[joint], errors.cosine[joint] = size * np.cos(phase), size * np.sin(phase)
    elif kind == "compliance":
        joint = int(rng.integers(1, 4))
        errors.compliance[joint] = rng.uniform(3e-5, 1e-4)
    elif kind == "backlash":
        errors.gap[joint], errors.approach = rng.uniform(5e-4, 2e-3), approaches(q)
    pose = oracle.flange(arm, q, errors)
    since = int(rng.integers(12, len(q) - 12))
    tracker, points = setup
    observed = oracle.markers(pose, tracker, points)
    if kind == "moved_base":
        moved = tracker.copy()
        moved[:3, 3] += 5e-4 * rng.standard_normal(3)
        moved[:3, :3] = oracle.Rotation.from_rotvec(5e-4 * rng.standard_normal(3)).as_matrix() @ tracker[:3, :3]
        observed[since:] = oracle.markers(pose[since:], moved, points)
    if kind == "loose_marker":
        loose = points.copy()
        loose[int(rng.integers(3))] += 5e-4 * rng.standard_normal(3)
        observed[since:] = oracle.markers(pose[since:], tracker, loose)
    observed = observed + NOISE * rng.standard_normal(observed.shape)
    poses = MeasuredPoses(q=q, measurement=Markers(count=3), observed=observed, approach=approaches(q))
    at_joint = kind not in ("moved_base", "loose_marker", "none")
    return robot, joint + 1 if at_joint else None, poses


def causes(cases: int, without: int, first: int) -> None:
    """Hidden causes: how often the one that is there is named, and how often one that is not."""
    robots = [robot_of(name) for name in ("ur10", "panda", "er3a")]
    named = false = 0
    for number in range(first, cases + without):
        kind = CAUSES[number % len(CAUSES)] if number < cases else "none"
        robot, joint, poses = hidden(kind, number, robots)
        found = calibrate(robot, poses).causes["findings"]
        causes = [(item["cause"], item["joint"]) for item in found]
        right = bool(causes) and causes[0] == (kind, joint)
        extra = len(causes) - (1 if right else 0)
        named += right
        false += extra
        print(
            f"{number:3} {robot.name:6} {kind:13} {joint} -> {causes}{'' if right or kind == 'none' else '  MISSED'}"
            f"{'' if not extra else '  FALSE'}",
            flush=True,
        )
    print(f"named {named} of {max(cases - first, 0)}; named but not there: {false} in {cases + without - first} cases")


def designs(names: list[str], sets: int) -> None:
    """Designed poses against random ones: errors of 20 against 60, what is possible at all, and O1."""
    from oed.experiments.pose_designs import PoseOptions, design_poses, observability_indices
    from oed.experiments.pose_designs.designing import _Allowed, _bounds, _candidates
    from oed.experiments.pose_designs.exchange import exchanged
    from oed.experiments.pose_designs.information import PoseInformation
    from oed.experiments.pose_designs.observability import pose_criterion

    for name in names:
        robot = robot_of(name)
        options = PoseOptions(noise={"m": NOISE})
        started = time.time()
        design = design_poses(robot, count=20, options=options)
        took = time.time() - started
        information = PoseInformation(robot, options.measurement, options.kinds, options.levels)
        model = options.surroundings.model(robot)
        bounds = _bounds(robot.limits, options.range_share, robot.chain.kinds)
        pool = _candidates(bounds, _Allowed(information, options, model), 2000, 77)
        rows = information.rows(pool)
        rng = np.random.default_rng(1)
        best = 0.0
        for _ in range(sets):
            own = rows[rng.permutation(len(rows))[:20]]
            values = np.linalg.eigvalsh(np.einsum("nrl,nrk->lk", own, own))
            best = max(best, observability_indices(values, 20)["O1"])
        # "By exchange alone": the best random set of 20, improved by exchange among the same poses.
        own = rows[exchanged(rows[:1000], 20, pose_criterion("d"))]
        exchange = observability_indices(np.linalg.eigvalsh(np.einsum("nrl,nrk->lk", own, own)), 20)["O1"]
        elsewhere = random_positions(robot, 300, seed=5)
        grams = np.swapaxes(rows, 1, 2) @ rows
        sixty = [grams[rng.permutation(len(rows))[:60]].sum(axis=0) for _ in range(50)]
        volume = lambda total: float(np.exp(-0.5 * np.linalg.slogdet(total)[1] / len(total)))  # noqa: E731
        seen = information.rows(elsewhere) * information._sigma[:, None]
        weight = np.einsum("nrl,nrk->lk", seen, seen)
        own = information.rows(design.q)
        total = np.einsum("nrl,nrk->lk", own, own)
        print(
            f"{name}: O1 of 20 designed {design.observability['O1']:.4g}, best of {sets} random sets {best:.4g}, "
            f"exchange alone {exchange:.4g}; {took:.1f} s, success {design.success}",
            flush=True,
        )
        random = np.median([volume(one) for one in sixty])
        optimum, slack = best_information(information, pool[:400], bounds, None)
        # log det of the true optimum is higher by L log(slack) at most.
        print(
            f"  mean error of the parameters (volume), over that of 60 random poses: designed "
            f"{volume(total) / random:.3f}, best possible {volume(20.0 * optimum) / random:.3f} "
            f"(at least {volume(20.0 * optimum) / random * np.exp(-0.5 * (slack - 1.0)):.3f})",
            flush=True,
        )
        random = np.median([information.prediction_error(one, elsewhere) for one in sixty])
        optimum, slack = best_information(information, pool[:400], bounds, weight)
        possible = information.prediction_error(20.0 * optimum, elsewhere) / random
        print(
            f"  error of predicted positions, over that of 60 random poses: designed "
            f"{information.prediction_error(total, elsewhere) / random:.3f}, best possible {possible:.3f} "
            f"(at least {possible * np.sqrt(max(2.0 - slack, 0.0)):.3f})",
            flush=True,
        )


def speed() -> None:
    """Time of 2,000 poses of seven joints with all parameters."""
    robot = robot_of("panda")
    arm = oracle.Arm.of(robot)
    rng = np.random.default_rng(0)
    truth, setup = oracle.usual_errors(arm, rng), oracle.usual_setup(rng)
    poses = measured(robot, random_positions(robot, 2000, seed=0), truth, setup, rng)
    started, cpu = time.time(), time.process_time()
    model = GeometryModel([robot], [term for term in TERMS if term.kind not in ("base_motion",)], poses)
    fit = fit_geometry(model)
    print(
        f"fit of {len(fit.parameters)} parameters, {fit.reduction.rank} independent, to 2,000 poses: "
        f"{time.time() - started:.1f} s, {time.process_time() - cpu:.1f} s of one processor; "
        f"sigma {1e3 * fit.weights.sigma['m']:.4f} mm"
    )
    started, cpu = time.time(), time.process_time()
    found = calibrate(robot, poses)
    print(
        f"calibrate with choice of kinds, held-out poses and diagnosis: {time.time() - started:.1f} s, "
        f"{time.process_time() - cpu:.1f} s of one processor"
    )
    print(found.summary())


def tiago(folder: Path, urdf: Path) -> None:
    """A PAL TIAGo measured by Qualisys: fitted on 30 November 2021, checked on 26 November."""
    import pandas as pd

    robot = load_robot(urdf, joints=list(RIGID))
    files = {day: folder / f"qualisys_2021-11-{day}_static_postures.csv" for day in ("30", "26")}
    for count in (1, 4):
        columns = [f"{axis}{k + 1}" for k in range(count) for axis in "xyz"]
        both = {}
        for day, path in files.items():
            table = pd.read_csv(path)
            q = table[list(RIGID)].to_numpy()
            # Rows come in the order of time, so that each joint's last direction is known.
            both[day] = MeasuredPoses(
                q=q, measurement=Markers(count=count), observed=table[columns].to_numpy(), approach=approaches(q)
            )
        train, check = both["30"], both["26"]
        near = np.array([np.min(np.max(np.abs(train.q - x), axis=1)) for x in check.q]) < 0.01
        low, high = train.q.min(axis=0) - 0.05, train.q.max(axis=0) + 0.05
        outside = ((check.q < low) | (check.q > high)).any(axis=1)
        for kinds in ((), ("joint_zero",), ("joint_zero", "backlash"), ("joint_zero", "link_placement"), None):
            found = calibrate(robot, train, options=CalibrationOptions(kinds=kinds, diagnose=False))
            terms = [error_term(kind) for kind in found.kinds]
            own = {item.name: item.value for item in found.errors}
            model = GeometryModel([robot], terms, check)
            values = np.array([own.get(item.name, 0.0) for item in model.errors])
            setup = fit_setup(robot, terms, train, found, values)
            error = 1e3 * np.linalg.norm(model.residual(values, setup)[:, :3], axis=1)
            inner = GeometryModel([robot], terms, train)
            fitted = 1e3 * np.linalg.norm(inner.residual(values, setup)[:, :3], axis=1)[found.poses.used]
            rms = lambda e: float(np.sqrt(np.mean(e**2)))  # noqa: E731
            label = "chosen by held-out poses" if kinds is None else "+".join(kinds) or "registration"
            print(
                f"{count} marker(s), {label} ({', '.join(found.kinds)}), {len(found.errors)} errors: training "
                f"{rms(fitted):.2f} mm, other session {rms(error):.2f} mm; repeated {rms(error[near]):.2f}, new inside "
                f"{rms(error[~near & ~outside]):.2f}, outside {rms(error[outside & ~near]):.2f}; outliers "
                f"{len(found.outliers)}",
                flush=True,
            )


def main() -> None:
    warnings.simplefilter("ignore")
    parser = argparse.ArgumentParser(description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("arms")
    one.add_argument("--draws", type=int, default=200)
    one.add_argument("--robot", default="ur10")
    one.add_argument("--select", action="store_true", help="choose the kinds by held-out poses, too")
    one.add_argument("--first", type=int, default=0, help="number of the first draw")
    two = commands.add_parser("rank")
    two.add_argument("--urdf", nargs="*", default=[], help="FILE or FILE:joint,joint")
    three = commands.add_parser("causes")
    three.add_argument("--cases", type=int, default=60)
    three.add_argument("--without", type=int, default=20)
    three.add_argument("--first", type=int, default=0, help="number of the first case")
    four = commands.add_parser("designs")
    four.add_argument("--robots", nargs="*", default=["ur10", "er3a", "panda", "scara"])
    four.add_argument("--sets", type=int, default=1000)
    commands.add_parser("speed")
    five = commands.add_parser("tiago")
    five.add_argument("folder", type=Path)
    five.add_argument("--urdf", type=Path, required=True)
    chosen = parser.parse_args()
    if chosen.command == "arms":
        arms(chosen.draws, chosen.robot, chosen.select, chosen.first)
    elif chosen.command == "rank":
        rank(chosen.urdf)
    elif chosen.command == "causes":
        causes(chosen.cases, chosen.without, chosen.first)
    elif chosen.command == "designs":
        designs(chosen.robots, chosen.sets)
    elif chosen.command == "speed":
        speed()
    else:
        tiago(chosen.folder, chosen.urdf)


if __name__ == "__main__":
    main()
