"""Records what a change of the house's shape must not change; prints what differs between two such records.

    python tests/unchanged.py record before.json     # on one commit, about three minutes
    python tests/unchanged.py record after.json      # on another, on the same computer
    python tests/unchanged.py compare before.json after.json

Recordings, a row of Table I, a comparison, a training, an evaluation, LeRobot's robot and the environments,
through the commands and public names alone. Another processor rounds otherwise: record both on one computer.
"""

import csv
import hashlib
import itertools
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

EPISODES = (
    ("ridgeback_ur10", "reach", "ee", "--seed=1"),
    ("ridgeback_ur10", "reach", "direct", "--seed=2"),
    ("ridgeback_ur10", "reach", "ee_dls", "--moving_obstacles=2"),
    ("ridgeback_ur10", "reach", "direct_filtered", "--control_fps=20", "--robot_fps=40"),
    ("ridgeback_ur10", "pick_place", "ee", "--seed=3"),
    ("ridgeback_ur10", "pick_place", "switching", "--seed=4"),
    ("ridgeback_ur10", "drawer", "base+ee", "--seed=5"),
    ("ridgeback_ur10", "tray", "ee", "--seed=6"),
    ("ridgeback_panda", "reach", "joints", "--seed=7"),
    ("ridgeback_panda", "pick_place", "ee", "--seed=8"),
    ("lekiwi", "reach", "ee", "--seed=9"),
    ("lekiwi", "pick_place", "ee", "--seed=10"),
)
PICTURES = (("reach", "ee"), ("pick_place", "switching"))
TIMED = ("wall_time_s", "cpu_time_s", "update_ms_median", "updates_per_s", "timing")
TIMED += ("update_s", "dataloading_s")


def run(name: str, *words: str) -> str:
    """Run a command of Handrail's; return what it printed."""
    module = ("handrail.scripts.bench",) if name == "bench" else ("handrail.scripts", name)
    words = (sys.executable, "-m", *module, *words)
    done = subprocess.run(words, capture_output=True, text=True, env=os.environ | {"HF_HUB_OFFLINE": "1"})
    if done.returncode:
        raise SystemExit(f"{' '.join(words)}\n{done.stdout}{done.stderr}")
    return done.stdout


def digest(*arrays) -> str:
    """Return what tells arrays apart."""
    found = hashlib.sha256()
    for each in arrays:
        found.update(np.ascontiguousarray(each).tobytes())
    return found.hexdigest()[:16]


def columns(root: Path) -> dict[str, np.ndarray]:
    """Read every column of numbers but the clocks, as pyarrow does."""
    import pyarrow.parquet

    tables = [pyarrow.parquet.read_table(path) for path in sorted(root.glob("data/**/*.parquet"))]
    names = [name for name in tables[0].column_names if name not in ("wall_clock", "controller.solve_time")]
    values = {name: list(itertools.chain(*(table[name].to_pylist() for table in tables))) for name in names}
    return {name: np.array(each) for name, each in values.items() if not isinstance(each[0], str)}


def videos(root: Path) -> dict[str, str]:
    """Return a digest of the decoded pictures of each camera."""
    import av

    found = {}
    for path in sorted(root.glob("videos/**/*.mp4")):
        with av.open(str(path)) as video:
            frames = [frame.to_ndarray(format="rgb24") for frame in video.decode(video=0)]
        found[str(path.relative_to(root))] = digest(*frames)
    return found


def episodes(folder: Path) -> dict:
    found = {}
    for robot, task, mode, *flags in EPISODES:
        root = folder / f"{robot}_{task}_{mode}"
        what = (f"--robot={robot}", f"--task={task}", f"--mode={mode}", *flags)
        run("record", str(root), "--dataset.num_episodes=1", "--time_limit=20", *what)
        values = columns(root)
        for name in ("action", "observation.state"):
            found[f"{root.name} {name}"] = digest(values[name])
        found[f"{root.name} frames, sum"] = [len(values["action"]), float(values["action"].sum())]
        found[f"{root.name} columns"] = {name: digest(each) for name, each in sorted(values.items())}
    return found


def pictures(folder: Path) -> dict:
    found = {}
    for task, mode in PICTURES:
        root = folder / f"pictures_{task}"
        two = ("--dataset.num_episodes=2", "--time_limit=20", f"--task={task}", f"--mode={mode}")
        run("record", str(root), *two, "--cameras=wrist,scene", "--image_size=96")
        found[f"{root.name} columns"] = {name: digest(each) for name, each in sorted(columns(root).items())}
        found[f"{root.name} videos"] = videos(root)
    return found


def table(folder: Path) -> dict:
    place = folder / "benchmark.json"
    run("bench", "goal_reaching", "--controllers=mpc,mink", "--goals=6", f"--json={place}")
    rows = json.loads(place.read_text())["profiles"]
    return {f"Table I {key}": value for key, value in numbers(rows).items()}


def comparison(folder: Path) -> dict:
    for mode in ("ee", "direct"):
        words = ("--task=reach", f"--mode={mode}", "--dataset.num_episodes=12", "--workers=1")
        run("record", str(folder / mode), *words)
    run("compare", str(folder / "ee"), str(folder / "direct"), f"--output={folder / 'compare'}")
    rows = rows_of(folder / "compare" / "differences.csv")
    return {f"compare {row['view']} {row['metric']}": row for row in rows}


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open() as file:
        return list(csv.DictReader(file))


def policy(folder: Path) -> dict:
    out = folder / "policy"
    run("train", str(folder / "ee"), f"--output={out}", "--actions=intent", "--steps=200", "--device=cpu")
    weights = {str(path.relative_to(out)): path.read_bytes() for path in out.rglob("model.safetensors")}
    place = folder / "evaluation.json"
    run("evaluate", str(out), "--episodes=6", f"--json={place}", "--workers=1")
    rollouts = numbers(json.loads(place.read_text()))
    return {
        "weights": {name: hashlib.sha256(weights[name]).hexdigest()[:16] for name in sorted(weights)},
        "curve": numbers(rows_of(out / "curve.csv")),
        **{f"evaluation {key}": value for key, value in rollouts.items()},
    }


def lerobot(folder: Path) -> dict:
    """LeRobot's robot, and the Gymnasium environments, driven at random from a seed."""
    del folder
    import gymnasium
    from lerobot.robots import make_robot_from_config
    from lerobot.robots.config import RobotConfig

    import handrail.collect.lerobot.plugins  # noqa: F401

    config = RobotConfig.get_choice_class("handrail_sim")(task="reach", realtime=False)
    robot = make_robot_from_config(config)
    robot.connect()
    rng, seen = np.random.default_rng(0), []
    for _ in range(60):
        sent = robot.send_action({name: float(rng.normal(scale=0.1)) for name in robot.action_features})
        seen.append([float(v) for v in (*sent.values(), *robot.get_observation().values()) if np.isscalar(v)])
    robot.disconnect()
    found = {"lerobot robot": digest(np.array(seen))}
    for name in ("PickPlace", "Reach"):
        env = gymnasium.make(f"handrail/{name}-v0")
        env.reset(seed=3)
        env.action_space.seed(0)
        steps = [env.step(env.action_space.sample()) for _ in range(60)]
        found[f"environment {name}"] = digest(*(np.hstack(flat(step[0])) for step in steps))
        found[f"environment {name} rewards"] = [float(step[1]) for step in steps[::10]]
        env.close()
    return found


def flat(value) -> list[np.ndarray]:
    if isinstance(value, dict):
        return [each for key in sorted(value) for each in flat(value[key])]
    return [np.ravel(value)]


def numbers(value, path: str = "") -> dict:
    """Flatten JSON to its numbers and words, without times."""
    if isinstance(value, dict):
        each = [numbers(v, f"{path}/{k}") for k, v in value.items() if k not in TIMED]
    elif isinstance(value, list):
        each = [numbers(v, f"{path}/{i}") for i, v in enumerate(value)]
    else:
        return {path: value}
    return {key: found for part in each for key, found in part.items()}


PARTS = {part.__name__: part for part in (episodes, pictures, table, comparison, policy, lerobot)}


def main() -> None:
    words = sys.argv[1:]
    if words[:1] == ["record"]:
        with tempfile.TemporaryDirectory() as folder:
            found = {}
            for name in words[2:] or PARTS:
                found |= PARTS[name](Path(folder))
        Path(words[1]).write_text(json.dumps(found, indent=1) + "\n")
        print(len(found), "values")
        return
    before, after = (json.loads(Path(word).read_text()) for word in words[1:3])
    different = [key for key in before | after if before.get(key) != after.get(key)]
    for key in different:
        print(f"{key}: {before.get(key)} -> {after.get(key)}")
    print(f"{len(before)} values, {len(different)} different")
    sys.exit(bool(different))


if __name__ == "__main__":
    main()
