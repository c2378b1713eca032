"""The search as a whole: what it promises about the gait that it hands out."""

from dataclasses import replace

import numpy as np
import pytest

from bifa.gait import Metric, SearchError, Settings, library, optimize, paper_space, simulations
from bifa.gait.methods import METHODS, Evaluated
from bifa.gait.objectives import NominalSpeed, RobustSpeed, distribution
from bifa.gait.search import (
    EXPLORE,
    VERIFYING_DRAWS,
    best_of_finalists,
    explore_on_robots,
    on_robots,
    possible_robots,
)
from bifa.gait.uncertainty import spread_of
from bifa.robot import BASELINE, Gait, nominal
from bifa.simulate import gait_rows, plant

ROBUST = np.array([[2.7, 193.0, 325.0, 0.655, 0.428, 0.428]])


def test_the_baseline_has_the_papers_speed(runs, nominal_plant):
    metric = Metric()
    for one in (metric, metric.quicker(), metric.finer()):
        speed = runs.judged([nominal_plant], np.zeros(1, int), gait_rows([BASELINE]), one).counted_mm_s[0]
        assert speed == pytest.approx(10.83, abs=0.02)


def test_a_short_nominal_search_doubles_the_baseline_and_stands_verification(runs, nominal_plant):
    optimum = optimize(nominal(), runs, Settings(method="cma", robust=False, evaluations=900, seed=3))
    assert optimum.nominal_mm_s > 20.0
    fine = replace(Metric(), cycles=30, judged=15, tolerance_m=1e-8)
    again = runs.judged([nominal_plant], np.zeros(1, int), gait_rows([optimum.gait]), fine).counted_mm_s[0]
    assert again == pytest.approx(optimum.nominal_mm_s, rel=1e-3)
    assert optimum.speeds_mm_s.shape == (VERIFYING_DRAWS,)


def test_robust_objective_is_the_order_statistic_of_the_distribution(runs, nominal_plant):
    draws = spread_of(nominal()).plants(nominal(), 32, seed=5)
    metric, space = Metric().quicker(), paper_space()
    points = np.array([space.point(space.gaits(space.point(gait_of(row))[None])[0]) for row in near(ROBUST[0])])
    objective = RobustSpeed(runs, nominal_plant, draws, space, metric, share=0.05)
    robust = objective(points)
    rows = gait_rows(space.gaits(points))
    speeds = np.sort(distribution(runs, draws, rows, metric), axis=1)
    alone = NominalSpeed(runs, nominal_plant, space, metric)(points)
    exact = np.minimum(speeds[:, 1], alone)  # the second smallest of 32
    best = int(np.argmax(exact))
    assert robust[best] == pytest.approx(exact[best])
    assert (robust >= exact - 1e-9).all()  # given up early: an upper bound ...
    assert (robust[robust > exact + 1e-9] < robust.max()).all()  # ... that does not win
    before = runs.count
    again = objective(points[best][None])
    assert runs.count - before < 1 + len(draws), "the hardest robots are known now, and the easy ones are not met"
    assert again == pytest.approx(exact[best], rel=0.01)


def test_a_gait_that_walks_by_a_hair_of_its_period_does_not_count_where_periods_jitter(runs, nominal_plant):
    metric, space = Metric().quicker(), paper_space()
    draws = [nominal_plant] * 16
    exact, jittered = (RobustSpeed(runs, nominal_plant, draws, space, metric, jitter=jitter) for jitter in (0.0, 0.005))
    point = space.point(library.load("fast").gait)[None]
    copies = np.concatenate([space.slower(point, share) for share in np.arange(0.02, -0.03, -0.001)])
    walks = exact(copies) > 20.0
    last = int(np.argmin(walks)) - 1  # one step of 0.1 % before the first copy that does not
    assert last >= 10
    assert jittered(copies[last][None])[0] < 0.5 * exact(copies[last][None])[0]
    well = copies[last - 8][None]  # 0.8 % slower
    assert jittered(well)[0] == pytest.approx(exact(well)[0], rel=2e-3)


def near(row):
    rng = np.random.default_rng(0)
    return row * (1 + 0.01 * rng.normal(size=(8, 5))[:, [0, 1, 2, 3, 4, 4]])


def gait_of(row):
    from bifa.robot.gait import Gait

    return Gait(*row.tolist())


def test_a_robot_that_cannot_walk_is_said_so(runs):
    slippery = nominal().with_values({"mu_s": 0.02, "mu_k": 0.02})
    up = Settings(robust=False, evaluations=60, metric=Metric(inclination_deg=90.0))
    with pytest.raises(SearchError, match=r"none of \d+ gaits walks without slipping"):
        optimize(slippery, runs, up)


def test_where_the_fastest_gait_falls_the_climb_begins_at_its_slower_copies(runs):
    """Most of the fast basin is beyond the cliff of some robots, where a robust objective is 0 and nothing leads up:
    of a robot whose valves choke a search ended at 8.5 mm/s in place of 18."""
    settings, spread = Settings(), spread_of(nominal(), 0.02)
    fast = settings.space.point(library.load("fast").gait)[None]
    assert on_robots(nominal(), runs, spread, settings, EXPLORE, 0)(fast)[0] < 2.0
    found = explore_on_robots(nominal(), runs, spread, Evaluated(fast, np.ones(1)), settings, lambda *_: None)
    assert found.best_value > 20.0


def test_a_gait_that_never_is_periodic_to_a_thousandth_counts_in_a_robust_search(runs):
    """A tether is longer by every cycle, and the feet slip by microns: a gait that had walked at 23.2 mm/s counted 0,
    and the search ended at 22.7."""
    dragging, settings = nominal().with_effects({"tether_drag": {"drag_N_m": 1.0}}), Settings()
    row = np.array([[2.68, 213.8, 349.96, 0.6433, 0.4655, 0.4655]])
    strict = [runs.judged([plant(dragging)], np.zeros(1, int), row, m) for m in (Metric(), Metric().finer())]
    assert all(one.refused[0] and one.speed_mm_s[0] > 22.0 for one in strict)
    known = Evaluated(settings.space.nearest([Gait(*row[0])]), np.ones(1))
    _, speed = best_of_finalists(dragging, runs, spread_of(dragging, 0.001), known, known, settings, lambda *_: None)
    assert speed > 22.0


@pytest.mark.parametrize("robust", [False, True])
def test_a_search_ends_no_slower_than_the_gaits_that_it_begins_from(runs, robust):
    known = library.load("robust").gait
    settings = Settings(robust=robust, evaluations=24, seed=5, begin=(BASELINE, known))
    found = optimize(nominal(), runs, settings)
    robots = found.spread.plants(nominal(), 256, 9) if robust else [plant(nominal())]
    speeds = distribution(runs, robots, gait_rows([known, found.gait]), Metric().finer())
    before, after = np.quantile(speeds, settings.share, axis=1)
    assert after >= 0.995 * before > 20.0


@pytest.mark.slow
def test_a_gait_beyond_the_cliff_gives_way_to_a_slower_copy(runs):
    """With a spread of 1 % a search on few robots ended at gaits that fail one robot in ten: 10th percentile 0."""
    sloping = nominal().with_effects({"inclination": {"angle_deg": 5.0}})
    settings, spread = Settings(spread=0.01), spread_of(sloping, 0.01)
    brittle = settings.space.slower(settings.space.point(library.load("robust").gait)[None], -0.04)
    metric = settings.metric
    draws = spread.plants(sloping, 128, seed=99)
    before = distribution(runs, draws, gait_rows(settings.space.gaits(brittle)), metric)
    assert np.quantile(before, 0.1) < 1.0
    found = Evaluated(brittle, np.ones(1))
    gait, speed = best_of_finalists(sloping, runs, spread, found, found, settings, lambda *_: None)
    after = distribution(runs, draws, gait_rows([gait]), metric)
    assert np.quantile(after, 0.1) > 0.95 * speed > 20.0


@pytest.mark.parametrize("elsewhere", [["robust"], []], ids=["the others are asked", "slower copies are"])
def test_where_all_gaits_of_one_place_fall(runs, monkeypatch, elsewhere):
    """Of a viscoelastic robot one seed in four found no gait: all finalists lay beyond the same cliff, where the robot
    creeps at best. With a tether drag one seed in five had none elsewhere either."""
    space = Settings().space
    fallen = space.slower(space.point(library.load("fast").gait)[None], -0.02)
    near = 0.0035 * np.array([[0.0, row, column, 0.0, 0.0] for row in range(8) for column in range(9)])
    points = np.vstack([fallen + near, *(space.point(library.load(name).gait) for name in elsewhere)])
    found = Evaluated(points, np.r_[np.full(len(near), 25.0), np.full(len(elsewhere), 22.0)])
    monkeypatch.setitem(METHODS, "cma", lambda *_: found)
    assert optimize(nominal(), runs, Settings(robust=False, refine=False)).nominal_mm_s > 21.0


def test_a_gait_of_which_no_cycle_is_like_the_one_before_counts_where_none_can_be(runs, monkeypatch):
    """On a supply that ripples a search kept to the few gaits whose period the ripple divides: 18.5 mm/s, not 22.8."""
    rippling = nominal().with_effects({"regulator_ripple": {}})
    space = Settings().space
    found = Evaluated(space.slower(space.point(library.load("robust").gait)[None], 0.02), np.array([22.0]))
    monkeypatch.setitem(METHODS, "cma", lambda *_: found)
    assert optimize(rippling, runs, Settings(robust=False, refine=False)).nominal_mm_s > 20.0
    with pytest.raises(SearchError):
        optimize(rippling, runs, Settings(robust=False, refine=False, metric=Strict()))


class Strict(Metric):
    """Cycles have to agree, whatever the robot."""

    def of_unlike_cycles(self) -> Metric:
        return self


def test_a_gait_that_falls_on_the_model_itself_is_not_taken_for_one_that_stands(runs):
    """Nearly all robots were as fast as the model there, which was not walking either."""
    settings, spread = Settings(spread=0.001), spread_of(nominal(), 0.001)
    fallen = settings.space.slower(settings.space.point(library.load("fast").gait)[None], -0.02)
    rows = gait_rows(settings.space.gaits(fallen))
    assert distribution(runs, [plant(nominal())], rows, Metric())[0, 0] < 2.0
    found = Evaluated(fallen, np.ones(1))
    _, speed = best_of_finalists(nominal(), runs, spread, found, found, settings, lambda *_: None)
    assert speed > 20.0


def test_a_finalist_that_keeps_less_than_the_best_promised_gives_way_to_one_that_keeps_it(runs, monkeypatch):
    """Of one supply that sags 8.5 % of 512 robots were just as fast as promised, and 10 % of 1,024 were not."""
    settings, spread = Settings(), spread_of(nominal(), 0.001)
    point = settings.space.point(library.load("robust").gait)
    lucky = np.vstack([point, settings.space.slower(point[None], 0.03)])
    fastest: list[float] = []

    def checked(runs, draws, rows, metric):
        speed = 1e3 * 0.06 / rows[0, 0]
        fastest.append(rows[0, 0])
        return np.full((1, len(draws)), 0.9 * speed if len(fastest) == 1 else speed)

    monkeypatch.setattr("bifa.gait.search.distribution", checked)
    found = Evaluated(lucky, np.array([2.0, 1.0]))
    gait, _ = best_of_finalists(nominal(), runs, spread, found, found, settings, lambda *_: None)
    assert len(fastest) > 1
    assert gait.period_s != fastest[0]


@pytest.mark.slow
def test_where_no_gait_suits_nine_robots_in_ten_the_best_is_given(runs):
    """Half the robots of a 20 % spread cannot walk at such speeds: no error, and not just any gait."""
    settings, spread = Settings(spread=0.2), spread_of(nominal(), 0.2)
    points = np.array([settings.space.point(library.load(name).gait) for name in ("fast", "robust")])
    found = Evaluated(points, np.ones(2))
    gait, speed = best_of_finalists(nominal(), runs, spread, found, found, settings, lambda *_: None)
    assert speed > 20.0
    assert gait.period_s > points[:, 0].max() * 2.0 + 2.0


def test_slower_copies_keep_to_the_space():
    space = paper_space()
    points = np.array([[0.5, 0.1, 0.2, 0.3, 0.4], [0.99, 0.1, 0.2, 0.3, 0.4]])
    slower = space.slower(points, 0.1)
    assert [gait.period_s for gait in space.gaits(slower)] == pytest.approx([3.3, 4.0])
    np.testing.assert_array_equal(slower[:, 1:], points[:, 1:])


def test_a_search_whose_runs_do_not_agree_says_so(runs):
    optimum = optimize(nominal(), runs, Settings(robust=False, evaluations=200, seed=1))
    explored = optimum.explored

    def ended(*values):
        ends = Evaluated(explored.points[: len(values)], np.array(values))
        return replace(optimum, explored=replace(explored, ends=ends))

    apart = ended(18.71, 10.0, 9.5)
    assert "best two of 3 runs ended at 18.71 and 10.00 mm/s" in apart.doubt
    assert "--evaluations" in apart.doubt
    assert ended(18.71, 18.6).doubt == ""


def test_an_unknown_method_is_refused(runs):
    with pytest.raises(SearchError, match="'sgd' is not one of cma, de, bo"):
        optimize(nominal(), runs, Settings(method="sgd"))


@pytest.mark.soak
@pytest.mark.parametrize("robust", [False, True])
def test_five_seeds_agree_and_reach_what_is_required(runs, robust):
    """23.4 mm/s on the model, 21.8 mm/s for nine robots in ten at 2 %; the seeds within 1 %."""
    optima = [optimize(nominal(), runs, Settings(robust=robust, seed=seed)) for seed in range(5)]
    speeds = np.array([o.quantile_mm_s if robust else o.nominal_mm_s for o in optima])
    assert speeds.min() >= (21.8 if robust else 23.4)
    assert np.ptp(speeds) <= 0.01 * speeds.mean()


def test_a_dask_cluster_gives_the_same_gait():
    distributed = pytest.importorskip("distributed")
    settings = Settings(method="cma", robust=False, evaluations=60, seed=1, refine=False)
    with (
        distributed.LocalCluster(n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None) as cluster,
        simulations(dask=cluster.scheduler_address) as remote,
    ):
        there = distributed_sample(remote, settings)
    with simulations() as here:
        np.testing.assert_array_equal(there, distributed_sample(here, settings))


def distributed_sample(pool, settings):
    points = np.random.default_rng(settings.seed).random((24, 5))
    objective = NominalSpeed(pool, plant(nominal()), settings.space, settings.metric)
    return objective(points)


def test_no_scheduler_and_no_workers_are_named():
    from bifa.cluster import ClusterError

    with pytest.raises(ClusterError, match="no dask scheduler answers at"), simulations(dask="nonsense://x"):
        pass


def test_robots_that_do_not_walk_with_a_gait_that_is_known_to_walk_are_none_of_those_it_may_be(runs):
    """Stribeck friction, 830: by the covariance alone a fifth stood still with gaits that had been walked, and the
    search at the edge ended at the baseline."""
    wide, known = replace(spread_of(nominal(), 0.05), is_guess=False), gait_of(ROBUST[0])
    metric = Metric().quicker()

    def slowest(settings, count=48):
        robots = possible_robots(nominal(), runs, wide, settings, count, 7)
        assert len(robots) == count
        speeds = distribution(runs, robots, gait_rows([known]), metric)[0]
        return speeds.min() / np.median(speeds)

    assert slowest(Settings()) < 0.5
    assert slowest(Settings(begin=(known,))) >= 0.8
