# SPDX-License-Identifier: BSD-3-Clause
"""Samples of distributions, held against NumPy's Philox, SciPy's quantiles and Sobol sequences, and ISO 286's formulas."""

import math

import numpy as np
import pytest

import kempe

COUNT = 40
PARAMETERS = ", ".join(f"p{k}: 0.5" for k in range(COUNT))
TEXT = f"""kempe: 1
name: numbers
parameters: {{{PARAMETERS}, length: 300 mm}}
bodies: {{a: {{joint: {{name: A, revolute: z, at: ground}}, mass: "1 kg*({'+'.join(f'p{k}' for k in range(COUNT))})", inertia: {{zz: "length*1 kg*m"}}}}}}
"""


@pytest.fixture(scope="module")
def model():
    return kempe.Model.from_text(TEXT)


def rows(values):
    return np.array([np.array(values[k]) for k in range(len(values))])


def uniform(columns):
    return ",".join(f"p{k}=0:1" for k in range(columns))


def test_random_numbers_are_those_of_philox(model):
    drawn = rows(model.sample(uniform(3), 20, seed=7))
    for k in range(20):
        for column in range(3):
            before = [(k - 1) % 2**64, (column - (k == 0)) % 2**64, 0, 0]  # NumPy counts before it draws
            if k == 0 and column == 0:
                before = [2**64 - 1] * 4
            elif k == 0:
                before = [2**64 - 1, column - 1, 0, 0]
            raw = np.random.Philox(key=np.array([7, 0], dtype=np.uint64), counter=np.array(before, dtype=np.uint64))
            number = int(raw.random_raw(1)[0])
            assert drawn[k, column] == ((number >> 12) + 0.5) * 2.0**-52


@pytest.mark.parametrize("design", ["random", "sobol"])
def test_a_sample_does_not_depend_on_their_number(model, design):
    few, many = (rows(model.sample(uniform(5), count, design=design)) for count in (10, 300))
    assert np.array_equal(few, many[:10])


def test_sobol_sequence(model):
    qmc = pytest.importorskip("scipy.stats").qmc
    ours = rows(model.sample(uniform(COUNT), 1000, design="sobol")) * 2.0**32 - 0.5
    theirs = qmc.Sobol(COUNT, scramble=False).random(1000) * 2.0**32
    assert np.array_equal(ours, theirs)


@pytest.mark.parametrize("count", [1, 2, 7, 64, 1000])
def test_latin_hypercube_has_one_sample_a_stratum(model, count):
    drawn = rows(model.sample(uniform(4), count, design="latin", seed=3))
    for column in drawn.T:
        assert np.array_equal(np.sort(np.floor(column * count)), np.arange(count))
    if count == 1000:
        correlations = np.corrcoef(drawn.T) - np.eye(4)
        assert np.abs(correlations).max() < 4 / math.sqrt(count)


def test_quantiles(model):
    stats = pytest.importorskip("scipy.stats")
    u = rows(model.sample("p0=0:1", 2000))[:, 0]
    for text, law in (
        ("normal(2, 0.5)", stats.norm(2, 0.5)),
        ("normal(2, 0.5, 1.9, 3)", stats.truncnorm(-0.2, 2, 2, 0.5)),
        ("triangular(1, 1.2, 3)", stats.triang(0.1, 1, 2)),
        ("triangular(1, 1, 3)", stats.triang(0, 1, 2)),
        ("triangular(1, 3, 3)", stats.triang(1, 1, 2)),
    ):
        ours = rows(model.sample(f"p0={text}", 2000))[:, 0]
        assert np.abs(ours - law.ppf(u)).max() < 1e-13, text


def test_units_of_distributions(model):
    drawn = rows(model.sample("length=normal(300 mm, 1 mm, 299 mm, 301 mm)", 500))[:, 0]
    assert 0.299 <= drawn.min() < 0.2992 and 0.3008 < drawn.max() <= 0.301


def test_correlations(model):
    correlations = {"p0:p1": 0.8, "p2:p0": -0.5}
    drawn = rows(model.sample("p0=normal(1, 2),p1=normal(0, 1),p2=normal(5, 0.1),p3=0:1", 20000, correlations=correlations))
    found = np.corrcoef(drawn.T)
    for (i, j), wanted in {(0, 1): 0.8, (0, 2): -0.5, (1, 2): 0, (0, 3): 0}.items():
        assert abs(found[i, j] - wanted) < 4 * (1 - wanted**2) / math.sqrt(20000)
    assert np.abs(np.mean(drawn, axis=0) - [1, 0, 5, 0.5]).max() < 4 * 2 / math.sqrt(20000)


def grade_of_formula(grade, low, high):
    """ISO 286-1, annex: tolerance units i and I of the geometric mean of a range of sizes, mm, as micrometres."""
    size = math.sqrt(low * high)
    unit = 0.45 * size ** (1 / 3) + 0.001 * size if high <= 500 else 0.004 * size + 2.1
    return unit * {5: 7, 6: 10, 7: 16, 8: 25, 9: 40}.get(grade, 64 * 10 ** ((grade - 10) / 5))


def test_grades(model):
    ends = [3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500, 630, 800, 1000, 1250, 1600, 2000, 2500, 3150]
    for low, high in zip(ends, ends[1:]):
        sized = kempe.Model.from_text(TEXT, length=f"{high} mm")
        least = None
        for grade in range(5, 19):
            end, middle = rows(sized.sample(f"length=IT{grade}(uniform)", 2, design="sobol"))[:, 0]
            tolerance = round((middle - end) * 2e6)
            assert abs((middle - end) * 2e6 / tolerance - 1) < 1e-6
            assert abs(tolerance / grade_of_formula(grade, low, high) - 1) < 0.11, (grade, high)
            assert least is None or tolerance > least
            least = tolerance
    drawn = rows(model.sample("length=IT7", 4000))[:, 0]
    assert abs(drawn - 0.3).max() <= 26e-6 and abs(np.std(drawn) / (52e-6 / 6) - 1) < 0.05


def test_grid(model):
    drawn = rows(model.sample({"p0": (0, 1, 3), "p1": (5, 7, 2)}, design="grid"))
    assert drawn.tolist() == [[0, 5], [0, 7], [0.5, 5], [0.5, 7], [1, 5], [1, 7]]


@pytest.mark.parametrize(
    "ranges, options, told",
    [
        ("p0=normal(1)", {}, "normal"),
        ("p0=normal(1, -1)", {}, "standard deviation must be positive"),
        ("p0=normal(1, 1, 3, 2)", {}, "least value must be below"),
        ("p0=normal(0, 1, 30, 31)", {}, "almost nothing"),
        ("p0=triangular(1, 4, 3)", {}, "in this order"),
        ("p0=IT4", {}, "IT5 to IT18"),
        ("q.A=IT7", {}, "parameter of the model"),
        ("p0=0:1", {"design": "latn"}, "unknown design 'latn'"),
        ("p0=0:1", {"design": "grid"}, "number of values"),
        ("p0=0:1:3", {}, "to design grid"),
        ("p0=0:1,p1=0:1", {"correlations": "p0:p1=1"}, "between -1 and 1"),
        ("p0=0:1,p1=0:1", {"correlations": "p0:p2=0.5"}, "two different names"),
        ("p0=0:1,p1=0:1,p2=0:1", {"correlations": "p0:p1=0.9,p1:p2=0.9,p0:p2=-0.9"}, "contradict"),
        ("p0=0:1,p0=0:1", {}, "given twice"),
        ("p0=normal(1 furlong, 1)", {}, "unknown unit 'furlong'"),
    ],
)
def test_mistakes(model, ranges, options, told):
    with pytest.raises(kempe.Error, match=told):
        model.sample(ranges, 10, **options)


def test_quantities_of_an_oscillator():
    model = kempe.Model.from_text(
        """kempe: 1
parameters: {m: 1, a: 0.1}
bodies: {b: {joint: {name: x, prismatic: x, at: ground}, mass: m}}
forces: {s: {joint: x, force: "-100*q(x)"}}
start: {q: {x: a}}
"""
    )
    masses = np.array([0.5, 1, 2, -1])
    words = {"top": "max(q(x))", "fast": "max(qd(x))", "down": "first(q(x) < 0)"}
    ensemble = model.ensemble({"m": masses}, quantities=words, limits=["fast < 0.99 m/s"])
    batch = ensemble.run(t_end=1, rtol=1e-10, atol=1e-12)
    rate = np.sqrt(100 / masses[:3])
    found = batch.quantities
    assert list(found) == ["top", "top.time", "fast", "fast.time", "down"]
    assert np.allclose(found["top"][:3], 0.1, rtol=1e-8)
    assert np.allclose(found["fast"][:3], 0.1 * rate, rtol=1e-8)
    assert np.allclose(found["down"][:3], np.pi / 2 / rate, rtol=1e-8)
    assert all(np.isnan(values[3]) for values in found.values())
    assert batch.limits == ["fail", "fail", "pass", ""]
    with pytest.raises(kempe.InputError, match="quantity:1:7: unknown coordinate 'y'"):
        model.ensemble({"m": masses}, quantities="max(q(y))")


def test_statistics_of_a_batch():
    scipy_stats = pytest.importorskip("scipy.stats")
    model = kempe.Model.from_text(
        """kempe: 1
parameters: {x1: 1, x2: 2, m: 1}
bodies: {b: {joint: {name: x, prismatic: x, at: ground}, mass: m}}
"""
    )
    values = model.sample("x1=normal(1, 0.1),x2=-1:1", 500, seed=3)
    drawn = rows(values)
    y = drawn[:, 0] ** 2 + drawn[:, 1]
    batch = model.ensemble(values, quantities={"y": "x1^2 + x2"}, limits="y < 1.5").run(t_end=1e-3)
    statistics = batch.statistics(confidence=0.9)
    assert np.array_equal(batch.quantities["y"], y)
    moments = statistics.moments
    low, high = scipy_stats.t.interval(0.9, 499, y.mean(), scipy_stats.sem(y))
    found = [moments[name][0] for name in ("count", "mean", "mean_low", "mean_high", "deviation")]
    assert np.allclose(found, [500, y.mean(), low, high, y.std(ddof=1)], rtol=1e-11)
    quantiles = statistics.quantiles
    assert np.allclose(quantiles["value"], np.quantile(y, quantiles["part"]), rtol=1e-12)
    passed = int((y < 1.5).sum())
    interval = scipy_stats.binomtest(passed, 500).proportion_ci(0.9, method="exact")
    within = statistics.within
    assert (within["judged"][0], within["passed"][0]) == (500, passed)
    assert np.allclose([within["low"][0], within["high"][0]], [interval.low, interval.high], rtol=1e-10)
    scaled = (drawn - drawn.mean(axis=0)) / drawn.std(axis=0)
    coefficients = np.linalg.lstsq(scaled, (y - y.mean()) / y.std(), rcond=None)[0]
    assert np.allclose(statistics.contributions["regression"], coefficients, rtol=1e-9)
    assert statistics.extremes["instance"][1] == y.argmax() + 1
    assert statistics.to_dict()["quantities"][0]["name"] == "y"
