"""Rounds: a policy learns from all data of its way so far, in the same time; what is gone comes again."""

import dataclasses
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from compare_helpers import check_texts
from datasets_helpers import create, frame_of, resume
from figure_helpers import shows
from places import ROOT
from study_helpers import Starter, changed, everything, make, run_here

from handrail.collect.commands import record as record_module
from handrail.controllers.errors import HandrailError
from handrail.datasets.reading.reader import read_episodes
from handrail.policies.study.config import StudyConfig
from handrail.policies.study.contrasts import DECLARED, contrasts
from handrail.policies.study.figures import figures
from handrail.policies.study.jobs import StudyLayout, jobs
from handrail.policies.study.power import plan
from handrail.policies.study.progress import StudyProgress
from handrail.policies.study.report import answer
from handrail.policies.study.results import gather
from handrail.policies.study.settings import evaluations, fingerprint, load_design, recording, training
from handrail.policies.study.tables import effort_table
from handrail.policies.study.work import collect

TEXT = (ROOT / "tests" / "data" / "studies" / "rounds.toml").read_text()
POLICY = "policy/reach/{}/0/intent-time"
LENGTHS = (40, 13, 28)  # of the episodes, in turn [frames]
SHARES = {"base+ee": (0.4, 0.5), "more-1": (0.5, 0.5), "helped-1": (0.6, 0.7)}
SHARES |= {"more-2": (0.5, 0.6), "helped-2": (1.0, 1.0)}


@pytest.fixture
def preset(tmp_path):
    path = tmp_path / "rounds.toml"
    path.write_text(TEXT)
    return str(path)


def test_a_policy_is_after_all_data_of_its_way_and_a_recording_after_the_policy_that_drives(preset):
    found = jobs(load_design(preset))
    names = [job.name for job in found]
    assert [job.cell.draw for job in found] == sorted(job.cell.draw for job in found)
    assert all(names.index(need) < names.index(job.name) for job in found for need in job.needs)
    needs = {job.name: job.needs for job in found}
    ways = (f"collect/reach/{kind}/0" for kind in ("base+ee", "helped-1", "helped-2"))
    assert needs[POLICY.format("helped-2")] == tuple(ways)
    assert needs["collect/reach/helped-2/0"] == (POLICY.format("helped-1"),)
    assert needs["collect/reach/helped-1/0"] == (POLICY.format("base+ee"),)


def test_ways_differ_in_who_drives_and_in_how_it_is_learnt_from_alone(preset):
    design = load_design(preset)
    (more, helped) = (
        {job.cell.kind: job for job in jobs(design) if job.policy and job.cell.draw == 0}[kind]
        for kind in ("more-2", "helped-2")
    )
    one, other = (recording(job.cell, design, Path("set"), 0, Path("driver")) for job in (more, helped))
    assert (one.operator, one.policy) == ("scripted", ())
    assert (other.operator, other.policy, other.arbiter) == ("hand_supervisor", ("driver",), "by_mask")
    assert (one.seed, one.person, one.mode) == (other.seed, other.person, other.mode)
    learnt = [training(job.policy, design, Path("set"), Path("out")) for job in (more, helped)]
    assert [each.corrections for each in learnt] == ["all", "weighted"]
    assert dataclasses.replace(learnt[1], corrections="all") == learnt[0]
    driven = [evaluations(job, design)["nominal"] for job in (more, helped)]
    assert driven[0].seeds == driven[1].seeds


def test_rounds_and_draws_record_other_scenes_but_drive_in_the_same(preset):
    design = load_design(preset)
    recorded, driven = {}, {}
    for job in jobs(design):
        seed = recording(job.cell, design, Path("set")).seed
        recorded.setdefault((job.cell.draw, len(job.cell.rounds)), set()).add(seed)
        if job.policy:
            driven.setdefault(job.cell.draw, set()).add(evaluations(job, design)["nominal"].seed)
    assert len(recorded) == len(set.union(*recorded.values())) == 6
    assert [len(seeds) for seeds in driven.values()] == [1, 1]


def other_way(design):
    """Return a design whose second way is another one."""
    other = dataclasses.replace(design.rounds.ways["helped"], operator="supervisor", corrections="all")
    rounds = dataclasses.replace(design.rounds, ways=design.rounds.ways | {"helped": other})
    return dataclasses.replace(design, rounds=rounds)


@pytest.mark.parametrize(
    ("change", "depends"),
    [
        (lambda design: changed(design, minutes=0.2), lambda job: True),
        (lambda design: changed(design, steps=11), lambda job: job.policy or job.cell.before),
        (lambda design: changed(design, round_minutes=0.06), lambda job: job.cell.before),
        (lambda design: dataclasses.replace(design, rollouts=19), lambda job: job.policy),
        (other_way, lambda job: job.cell.mode == "helped"),
    ],
)
def test_a_job_depends_on_all_that_was_before_it_and_on_nothing_else(change, depends, preset):
    design = load_design(preset)
    for job in jobs(design):
        assert (fingerprint(job, change(design)) != fingerprint(job, design)) == bool(depends(job)), job.name


def gone(layout, job):
    shutil.rmtree(layout.policy(job.policy) if job.policy else layout.dataset(job.cell))


def unfinished(layout, job):
    (layout.policy(job.policy) / "checkpoints/000010").rename(
        layout.policy(job.policy) / "checkpoints/000004"
    )


def test_a_recording_of_more_than_was_kept_is_cut_before_it_is_learnt_from(tmp_path, preset):
    """Made again, and interrupted: more of it is there than fits into the time."""
    design, layout, found = everything(tmp_path, preset)
    by_name = {job.name: job for job in found}
    note = layout.done(by_name["collect/reach/more-1/0"])
    content = json.loads(note.read_text())
    content["result"]["episodes"] -= 1
    note.write_text(json.dumps(content))
    layout.done(by_name[POLICY.format("more-1")]).unlink()
    again = {job.name for job in StudyProgress(design, layout).todo()}
    assert {"collect/reach/more-1/0", POLICY.format("more-1")} <= again


@pytest.mark.parametrize("damage", [gone, unfinished])
@pytest.mark.parametrize("only", ["", "reach/helped-2/0"])
def test_lost_files_are_made_again_as_far_back_as_needed(damage, only, tmp_path, preset):
    design, layout, found = everything(tmp_path, preset)
    by_name = {job.name: job for job in found}
    damage(layout, by_name[POLICY.format("helped-1")])
    gone(layout, by_name["collect/reach/base+ee/0"])
    gone(layout, by_name["collect/reach/more-1/0"])
    assert StudyProgress(design, layout).todo() == []
    layout.done(by_name["collect/reach/helped-2/0"]).unlink()
    layout.done(by_name["collect/reach/more-2/1"]).unlink()
    again = ["collect/reach/base+ee/0", POLICY.format("helped-1"), "collect/reach/helped-2/0"]
    starter = Starter()
    assert run_here(StudyConfig(preset, str(layout.root), only=only), starter) == 0
    assert starter.begun == again + ["collect/reach/more-2/1"] * (only == "")


def test_a_cell_alone_brings_what_it_comes_from(tmp_path, preset):
    starter = Starter()
    assert run_here(StudyConfig(preset, str(tmp_path / "study"), only="reach/helped-2/1"), starter) == 0
    kinds = "base+ee", "helped-1", "helped-2"
    assert starter.begun == [
        name for kind in kinds for name in (f"collect/reach/{kind}/1", f"policy/reach/{kind}/1/intent-time")
    ]


def test_a_way_has_the_attempts_that_fit_into_its_time_also_when_it_goes_on(tmp_path, preset, monkeypatch):
    """Law: the longest beginning of the same attempts that is no longer than the time; one at least."""
    turns = []

    def record(config, share):
        turns.append((config.policy, share is None))
        with (resume if config.resume else create)(config.dataset.folder) as writer:
            for _ in range(config.dataset.num_episodes):
                number = writer.num_episodes
                for index in range(LENGTHS[number % 3]):
                    writer.add_frame(frame_of(number, index, cameras=False), "reach")
                writer.save_episode({"success": number > 0, "seed": number})

    monkeypatch.setattr(record_module, "record", record)
    design, layout = load_design(preset), StudyLayout(tmp_path / "study")
    found = {job.cell.kind: job for job in jobs(design) if not job.policy and job.cell.draw == 0}
    lengths = np.cumsum([LENGTHS[number % 3] for number in range(20)])
    for kind, minutes in (("helped-1", 0.2), ("more-1", 0.2), ("more-2", 0.01)):
        for _ in range(2):
            collect(found[kind], changed(design, round_minutes=minutes), layout)
            rows = read_episodes(layout.dataset(found[kind].cell))
            assert len(rows) == max(1, sum(lengths <= 1200 * minutes)) < len(lengths)
            assert [row["seed"] for row in rows] == list(range(len(rows)))
    driver = str(layout.policy(found["helped-1"].before.policy))
    assert set(turns) == {((driver,), False), ((), True)}


@pytest.fixture
def made(tmp_path, preset):
    """Return what a study of made-up rollouts gathers."""

    def gathered(shares=SHARES):
        shares = {f"{label} intent": each for label, each in shares.items()}
        design, layout = load_design(preset), StudyLayout(tmp_path / "made")
        for job in jobs(design):
            make(job, design, layout, shares)
        return gather(StudyProgress(design, layout))

    return gathered


def test_the_answer_is_the_declared_ways_after_the_last_round(made):
    results = made()
    found, design = contrasts(results), results.progress.design
    (declared,) = (each for each in found if each.family == DECLARED)
    helped, more = (results.find("reach", f"{way}-2 intent").shares for way in ("helped", "more"))
    assert declared.estimate == pytest.approx(np.mean([helped[draw] - more[draw] for draw in (0, 1)]))
    assert declared.p_adjusted == declared.p is not None
    assert "helped − more after round 1" in {each.label for each in found if each.family != DECLARED}
    (said,) = answer(found, design)
    means = " against ".join(f"{100 * np.mean(list(each.values())):.0f} %" for each in (helped, more))
    assert said.startswith(f"helped − more after round 2: {means}; ")
    assert "helped − more after round 2" in plan(design)


def test_the_figure_has_all_rounds_of_a_way_from_the_same_policy_on(made):
    results = made()
    drawn = figures(results, contrasts(results))
    assert drawn.keys() == {"contrasts", "rounds"}
    for way in ("more", "helped"):
        kinds = ("base+ee", f"{way}-1", f"{way}-2")
        values = [results.find("reach", f"{kind} intent").value.estimate for kind in kinds]
        assert shows(drawn["rounds"], [100 * value for value in values])
    for figure in drawn.values():
        check_texts(figure)


def test_the_effort_is_of_all_draws_by_the_minute(made):
    rows = {row[0]: row[1:] for row in effort_table("reach", made()).rows}
    assert list(rows) == ["base+ee", "more-1", "helped-1", "more-2", "helped-2"]
    assert rows["helped-1"] == ("180 s", "60 s", "33 %", "8.00", "2.00")  # COLLECTED, twice


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('["base+ee"]', '["base+ee", "ee"]'), "expected one mode and a task"),
        (("round_minutes = 0.05", ""), "expected round_minutes of task reach, found none"),
        (('[["helped", "more"]]', '[["helped", "most"]]'), "unknown way 'most'"),
        (('[["helped", "more"]]', '[["helped", "helped"]]'), "primary: expected two ways each, once"),
        (("[rounds.ways.more]", '[rounds.ways."../x"]'), r"names are words, got '\.\./x'"),
        (("[rounds]", "[beside]\ndraws = 1\n[rounds]"), "rounds: expected no beside"),
        (("draws = 2", "draws = 2\ncurve = [5]"), "rounds: expected no curve"),
        (
            ('"hand_supervisor"\narbiter = "by_mask"', '"browser"'),
            "expected a script or a supervisor of each way",
        ),
        (('[["helped", "more"]]', '[["helped", "more"], ["more", "helped"]]'), "primary: expected two ways"),
        (("round_minutes", "sizes = [0.05]\nround_minutes"), r"of task reach, got sizes \(0.05,\)"),
        (("base+ee", "ee_and_base+ee"), "unknown mode of rounds 'ee_and_base"),
        (('"by_mask"', '"by_luck"'), "by_luck"),
        (('"hand_supervisor"', '"gamepad_of_mine"'), "gamepad_of_mine"),
        (('arbiter = "by_mask"', ""), "expected --policy"),
        (('"weighted"', '"often"'), "often"),
    ],
)
def test_wrong_rounds_are_one_line(change, words, tmp_path):
    path = tmp_path / "wrong.toml"
    path.write_text(TEXT.replace(*change))
    with pytest.raises(HandrailError, match=words):
        load_design(str(path))
