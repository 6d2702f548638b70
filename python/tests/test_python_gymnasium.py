# SPDX-License-Identifier: BSD-3-Clause
"""Environments of Gymnasium: its interface by its own checks, equal bits of runs, single and many instances, failures with reasons.
Gymnasium may be a package of another Python (KEMPE_OPTIMISER_PYTHON)."""

import importlib
import inspect
import os
import re
import signal
import subprocess
import sys
import textwrap
import threading
import time
import warnings

import kempe
import numpy as np
import pytest
from conftest import ROOT

INPUTS = {"u": (-20.0, 20.0)}
TASK = {
    "step_time": 0.02,
    "horizon": 1.0,
    "limits": {"q(phi)": (-0.5, 0.5)},
    "start": {"q(phi)": (-0.1, 0.1), "qd(x)": (-0.2, 0.2)},
}


def upright(values):
    assert values["q(phi)"].flags.c_contiguous
    return np.cos(values["q(phi)"]) - 1e-3 * values["u"] ** 2


@pytest.fixture(scope="module", autouse=True)
def library():
    other, before = os.environ.get("KEMPE_OPTIMISER_PYTHON"), list(sys.path)
    if other:
        words = "import gymnasium, os; print(os.path.dirname(os.path.dirname(gymnasium.__file__)))"
        done = subprocess.run([other, "-c", words], capture_output=True, text=True)
        sys.path += done.stdout.split("\n")[:1] if done.returncode == 0 else []
    pytest.importorskip("gymnasium", minversion="1.0")
    importlib.reload(importlib.import_module("kempe.gymnasium"))  # others may have imported it without Gymnasium
    yield
    sys.path[:] = before


@pytest.fixture
def cart():
    return kempe.Model(ROOT / "tests/models/cart_and_linkage.yaml")


def single(model, **more):
    from kempe.gymnasium import Environment

    return Environment(model, INPUTS, upright, **{**TASK, **more})


def many(model, count, **more):
    from kempe.gymnasium import VectorEnvironment

    return VectorEnvironment(model, count, INPUTS, upright, **{**TASK, **more})


def test_gymnasium_accepts_it(cart):
    from gymnasium.utils.env_checker import check_env

    env = single(cart)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", "(?s).*(infinity|not having a spec|recommend).*")
        check_env(env)
    assert env.action_space.low == -20 and env.action_space.high == 20 and env.observation_space.shape == (8,)
    assert repr(env).startswith("<Environment 'cart and linkage': inputs u, 8 observations")


def test_a_step_is_a_step_of_the_stepper(cart):
    env = single(cart, start=None, limits=None, observation="q, qd", more="position(bar.end)", rtol=1e-9)
    stepper = cart.system().stepper(t_end=1.02, rtol=1e-9)
    outputs = cart.system().outputs("q, qd")
    observation, info = env.reset(seed=3)
    assert (observation == outputs.at_stepper(stepper)).all() and info == {}
    for k in range(1, 20):
        action = 10 * np.sin(k)
        stepper.set_input("u", action)
        stepper.advance(0.02 * k)
        observation, reward, terminated, truncated, info = env.step([action])
        assert (observation == [*stepper.q, *stepper.qd]).all() and not terminated and not truncated and info == {}
        assert reward == np.cos(np.array([stepper.q[1]]))[0] - 1e-3 * np.array([action])[0] ** 2


def test_actions_stop_at_their_limits(cart):
    first, second = single(cart), single(cart)
    first.reset(seed=5), second.reset(seed=5)
    assert (first.step([1e6])[0] == second.step([20.0])[0]).all()
    assert not (first.step([20.0])[0] == second.step([19.0])[0]).all()


def test_starts_are_drawn_and_closed(cart):
    env = single(cart, more="qd")
    drawn = []
    for seed in range(20):
        observation, _ = env.reset(seed=seed)
        q, qd = observation[:4], observation[4:]
        generator = np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed)))
        assert abs(q[1] - generator.uniform(-0.1, 0.1)) < 1e-14 and abs(qd[0] - generator.uniform(-0.2, 0.2)) < 1e-14
        assert abs(cart.system().workspace().evaluate(0.0, q, qd).h).max() < 1e-12
        drawn.append(q[1])
    assert len(set(drawn)) == 20
    observation, _ = env.reset(options={"start": {"q(phi)": 0.25}})
    assert abs(observation[1] - 0.25) < 1e-14 and observation[4] == 0


def test_an_episode_has_the_same_bits_after_others(cart):
    def episode(env):
        rows = [env.reset(seed=7)[0]]
        rows += [env.step([3 * np.cos(k)])[0] for k in range(25)]
        return np.array(rows)

    env = single(cart)
    first = episode(env)
    env.reset(seed=1)
    env.step([20.0])
    assert (episode(env) == first).all() and (episode(single(cart)) == first).all()


@pytest.mark.parametrize("threads", [1, 3])
def test_many_have_the_bits_of_single_ones(cart, threads):
    count, rng = 7, np.random.default_rng(0)
    envs, alone = many(cart, count, threads=threads, horizon=0.4, lanes=False), [single(cart, horizon=0.4) for _ in range(count)]
    assert envs.no_lanes == "lanes=False" and "7 instances by steppers (lanes=False), inputs u" in repr(envs)
    observations, infos = envs.reset(seed=11)
    for k, env in enumerate(alone):
        assert (observations[k] == env.reset(seed=11 + k)[0]).all()
    over, ends = np.zeros(count, dtype=bool), set()
    for _ in range(60):
        actions = rng.uniform(-20, 20, (count, 1))
        observations, rewards, terminated, truncated, infos = envs.step(actions)
        for k, env in enumerate(alone):
            if over[k]:  # its next episode has begun
                expected, reward, ended, cut, info = env.reset()[0], 0.0, False, False, {}
            else:
                expected, reward, ended, cut, info = env.step(actions[k])
            assert (observations[k] == expected).all() and rewards[k] == reward
            assert (terminated[k], truncated[k]) == (ended, cut)
            assert ("reason" in info) == bool(infos.get("_reason", over * False)[k])
            if info:
                assert infos["reason"][k] == info["reason"]
            ends.add((ended, cut))
        over = terminated | truncated
    assert ends == {(False, False), (True, False), (False, True)}
    envs.close()


@pytest.mark.parametrize("threads", [1, 3])
def test_lanes_depend_on_no_neighbour(cart, threads):
    """The bits of one instance by itself, and the motions of steppers to the tolerance."""
    count, rng, task = 21, np.random.default_rng(0), {"horizon": 0.4, "rtol": 1e-10, "more": "position(bar.end), qdd"}
    envs = many(cart, count, threads=threads, **task)
    alone, steppers = [many(cart, 1, **task) for _ in range(count)], many(cart, count, lanes=False, **task)
    assert envs.no_lanes == "" and "21 instances in lanes, inputs u" in repr(envs)
    observations, _ = envs.reset(seed=11)
    expected, _ = steppers.reset(seed=11)
    assert np.abs(observations - expected).max() < 1e-12
    for k, env in enumerate(alone):
        assert (observations[k] == env.reset(seed=11 + k)[0][0]).all()
    ends = set()
    for _ in range(60):
        actions = rng.uniform(-20, 20, (count, 1))
        observations, rewards, terminated, truncated, infos = envs.step(actions)
        for k, env in enumerate(alone):
            rows = env.step(actions[k : k + 1])
            assert (observations[k] == rows[0][0]).all() and (rewards[k], terminated[k], truncated[k]) == tuple(each[0] for each in rows[1:4])
            assert ("reason" in rows[4]) == bool(terminated[k]) and (not terminated[k] or infos["reason"][k] == rows[4]["reason"][0])
        expected = steppers.step(actions)
        assert np.abs(observations - expected[0]).max() < 1e-7 and np.abs(rewards - expected[1]).max() < 1e-7
        assert (terminated == expected[2]).all() and (truncated == expected[3]).all()
        ends |= set(zip(terminated.tolist(), truncated.tolist()))
    assert ends == {(False, False), (True, False), (False, True)}


def test_a_model_that_lanes_cannot_run():
    """A ball on a rigid floor, by an integrator that lanes do not have."""
    from kempe.gymnasium import Environment, VectorEnvironment

    text = (ROOT / "tests/models/contact_bounce.yaml").read_text() + "inputs: {u: {unit: N}}\nforces: {push: {joint: z, force: u}}\n"
    model, task = kempe.Model.from_text(text), {"step_time": 0.05, "horizon": 1, "integrator": "radau"}
    envs = VectorEnvironment(model, 2, {"u": (-1, 1)}, lambda values: values["t"], **task)
    assert envs.no_lanes == "another integrator" and "by steppers (another integrator)" in repr(envs)
    env = Environment(model, {"u": (-1, 1)}, lambda values: values["t"], **task)
    assert (envs.reset(seed=0)[0] == env.reset(seed=0)[0]).all()
    assert all((envs.step([[0.5]] * 2)[0] == env.step([0.5])[0]).all() for _ in range(12))


def test_impacts_in_lanes():
    from kempe.gymnasium import Environment, VectorEnvironment

    text = (ROOT / "tests/models/contact_bounce.yaml").read_text() + "inputs: {u: {unit: N}}\nforces: {push: {joint: z, force: u}}\n"
    model, task = kempe.Model.from_text(text), {"step_time": 0.05, "horizon": 2, "start": {"q(z)": (0.2, 0.6)}, "rtol": 1e-9}
    envs = VectorEnvironment(model, 2, {"u": (-9, 9)}, lambda values: values["t"], **task)
    env = Environment(model, {"u": (-9, 9)}, lambda values: values["t"], **task)
    observations, single = envs.reset(seed=3)[0], env.reset(seed=3)[0]
    assert envs.no_lanes == "" and (observations[0] == single).all() and (observations[1] != single).any()
    falls = 0
    for k in range(39):
        observations, single = envs.step([[9 * np.sin(k)]] * 2)[0], env.step([9 * np.sin(k)])[0]
        assert np.abs(observations[0] - single).max() < 1e-5
        falls += single[1] < 0
    assert 0 < falls < 39


def test_limits_end_an_episode_with_a_reason(cart):
    env = single(cart)
    env.reset(seed=0)
    ended = False
    while not ended:
        observation, reward, ended, cut, info = env.step([-20.0])
        assert not cut
    assert abs(observation[1]) > 0.5 and reward != 0
    assert info["reason"] == f"q.phi = {observation[1]:g} is outside its limits -0.5 .. 0.5"


def test_a_mechanism_that_locks_is_terminated():
    """Its slider is driven beyond its reach, which ends at t = 1.5 s."""
    from kempe.gymnasium import Environment

    text = (ROOT / "tests/models/locked_slider_crank.yaml").read_text()
    text += "inputs: {u: {unit: N*m}}\nforces: {motor: {joint: crank, torque: u}}\n"
    env = Environment(kempe.Model.from_text(text), INPUTS, lambda values: values["t"], step_time=0.1, horizon=3, failure_reward=-7.0)
    before, _ = env.reset()
    for k in range(1, 31):
        observation, reward, ended, cut, info = env.step([1.0])
        if ended:
            break
        assert reward == 0.1 * k and not cut
        before = observation
    assert k == 16 and ended and not cut and reward == -7.0 and "limit position" in info["reason"] and np.isfinite(observation).all()


@pytest.mark.parametrize("lanes", [False, True])
def test_a_failure_of_one_is_none_of_the_others(cart, lanes):
    """The force is the root of a negative number beyond x = 0.2 m."""
    text = (ROOT / "tests/models/cart_and_linkage.yaml").read_text().replace("force: u", 'force: "u*sqrt(0.2 - q(x))"')
    model, task = kempe.Model.from_text(text), {"start": None, "limits": None, "failure_reward": -5.0}
    env, envs = single(model, **task), many(model, 3, threads=2, lanes=lanes, **task)
    assert (envs.no_lanes == "") == lanes
    near = 1e-5 if lanes else 0  # lanes have other bits than the stepper of one environment
    before, _ = env.reset()
    envs.reset()
    for _ in range(50):
        observation, reward, ended, cut, info = env.step([20.0])
        observations, rewards, terminated, truncated, infos = envs.step([[20.0], [0.0], [20.0]])
        assert (observations[0] == observations[2]).all() and rewards[0] == rewards[2]
        assert np.abs(observations[0] - observation).max() <= near and abs(rewards[0] - reward) <= near
        assert terminated.tolist() == [ended, False, ended] and not cut and not truncated.any()
        if ended:
            break
        before = observation
    assert ended and reward == -5.0 and abs(observation[0] - 0.2) < 0.1 and (observation[:4] == before[:4]).all()
    assert infos["reason"][0] == infos["reason"][2] != "" != info["reason"] and (lanes or infos["reason"][0] == info["reason"])
    assert infos["_reason"].tolist() == [True, False, True]
    observations, rewards, terminated, truncated, infos = envs.step([[0.0]] * 3)  # the others have begun again
    assert rewards[0] == 0 and observations[0, 0] == 0 and rewards[1] != 0 and "reason" not in infos


def test_starts_that_cannot_close(cart):
    from gymnasium.error import ResetNeeded

    env = single(cart, start={"q(phi)": (-0.1, 0.1), "q(b)": (2.0, 2.1)})
    with pytest.raises(kempe.FailedError, match="none of 100 starts that were drawn closes the loops"):
        env.reset(seed=0)
    with pytest.raises(ResetNeeded):
        env.step([0.0])
    some = single(cart, start=lambda random: {"q(phi)": 0.1, "q(b)": random.choice([0.1, 2.0])})
    draws = [some.reset(seed=seed)[1].get("start_draws", 1) for seed in range(12)]
    assert 1 in draws and max(draws) > 1
    with pytest.raises(kempe.FailedError, match="the start that is given"):
        env.reset(options={"start": {"q(phi)": 0.1, "q(b)": 2.0}})


@pytest.mark.parametrize(
    "change, said",
    [
        ({"step_time": 0.0}, "a positive number"),
        ({"horizon": 0.03}, "not a whole number of steps"),
        ({"limits": {"q(psi)": (0, 1)}}, "q.psi"),
        ({"t_end": 3}, "leave t_end out"),
        ({"observation": ""}, "observation is empty"),
    ],
)
def test_mistakes(cart, change, said):
    with pytest.raises(kempe.ArgumentError, match=said):
        single(cart, **change)


def test_mistakes_in_names_and_shapes(cart):
    from kempe.gymnasium import Environment

    with pytest.raises(kempe.ArgumentError, match="input 'v'"):
        Environment(cart, {"v": (-1, 1)}, upright, step_time=0.1, horizon=1)
    with pytest.raises(kempe.ArgumentError, match="two finite numbers"):
        Environment(cart, {"u": (-1, np.inf)}, upright, step_time=0.1, horizon=1)
    env = single(cart, start={"q(psi)": 0.1})
    with pytest.raises(kempe.ArgumentError, match="q.psi"):
        env.reset()
    env = single(cart)
    env.reset(seed=0)
    with pytest.raises(ValueError, match="action has 1 values"):
        env.step([1.0, 2.0])
    env.reset(seed=0)
    with pytest.raises(ValueError, match="not a finite number"):
        env.step([np.nan])


def test_some_instances_begin_again(cart):
    envs = many(cart, 3, threads=1)
    first, _ = envs.reset(seed=[4, 5, 6])
    moved = envs.step(np.ones((3, 1)))[0]
    again, _ = envs.reset(seed=[4, None, None], options={"reset_mask": np.array([True, False, False])})
    assert (again[0] == first[0]).all() and (again[1:] == moved[1:]).all()


def test_a_wrapper_of_gymnasium(cart):
    from gymnasium.wrappers.vector import RecordEpisodeStatistics

    envs = RecordEpisodeStatistics(many(cart, 4, horizon=0.1))
    envs.reset(seed=0)
    lengths = []
    for _ in range(12):
        infos = envs.step(np.zeros((4, 1)))[4]
        lengths += list(infos["episode"]["l"][infos["_episode"]]) if "episode" in infos else []
    assert lengths == [5] * 8


@pytest.mark.parametrize("lanes", [False, True])
@pytest.mark.parametrize("threads", [1, 2])
def test_interrupts(cart, threads, lanes):
    from gymnasium.error import ResetNeeded

    bound = {} if lanes else {"max_steps": 100000000}
    envs = many(cart, 4, threads=threads, limits=None, step_time=1e5, horizon=1e5, lanes=lanes, **bound)
    envs.reset(seed=0)
    timer = threading.Timer(0.2, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        envs.step(np.ones((4, 1)))
    assert time.monotonic() - begin < 0.2 + 0.3
    with pytest.raises(ResetNeeded):
        envs.step(np.ones((4, 1)))
    envs.close()


def test_without_gymnasium():
    program = (
        "import sys; sys.modules['gymnasium'] = None\nimport kempe\nfrom kempe.gymnasium import Environment\n"
        f"model = kempe.Model({str(ROOT / 'tests/models/cart_and_linkage.yaml')!r})\n"
        "try:\n    Environment(model, {'u': (-1, 1)}, abs, step_time=0.1, horizon=1)\n"
        "except ImportError as error:\n    print(error)\n"
    )
    said = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
    assert said.startswith("environments need the package gymnasium (pip install gymnasium)")


def test_the_page(monkeypatch):
    """The program of docs/learning.md runs."""
    page = (ROOT / "docs/learning.md").read_text()
    blocks = re.findall(r"(?:^    .*\n|^\n(?=    ))+", page, re.M)
    assert len(blocks) == 1 and "assert" in blocks[0]
    monkeypatch.chdir(ROOT)
    exec(textwrap.dedent(blocks[0]), {})


def test_signatures(cart):
    """Both environments have the same keywords, which are written once."""
    from kempe.gymnasium import Environment, VectorEnvironment

    one, several = (list(inspect.signature(each).parameters.values()) for each in (Environment, VectorEnvironment))
    assert [each.name for each in one][:5] == ["model", "inputs", "reward", "step_time", "horizon"]
    assert [each for each in several if each.name not in ("count", "threads", "lanes")] == one and one[-1].kind is inspect.Parameter.VAR_KEYWORD
    assert one[3].default is inspect.Parameter.empty and {each.name: each.default for each in one}["observation"] == ("q", "qd")
    for make, count in ((Environment, ()), (VectorEnvironment, (2,))):
        with pytest.raises(TypeError, match="missing 2 required keyword-only arguments: 'step_time' and 'horizon'") as caught:
            make(cart, *count, INPUTS, upright)
        assert "_task" not in str(caught.value)
        with pytest.raises(TypeError, match="no keyword 'limit'"):
            make(cart, *count, INPUTS, upright, **TASK, limit={})
