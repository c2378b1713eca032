"""What the live page's server makes of requests that its page would not send."""

import http.client
import json
from concurrent.futures import Future

import pytest

from bifa.live.web.server import LivePage, served
from bifa.robot import nominal


class Stopping:
    """A pilot that only counts its stops."""

    def __init__(self) -> None:
        self.stops = 0

    def stop(self) -> Future:
        self.stops += 1
        done: Future = Future()
        done.set_result(None)
        return done


@pytest.fixture
def live():
    return LivePage(Stopping(), "<!doctype html>", nominal())


@pytest.fixture
def post(live):
    """Post a body; the status and the answer."""
    with served(live) as address:

        def posted(name: str, body: str):
            connection = http.client.HTTPConnection("127.0.0.1", address.port, timeout=20)
            connection.request("POST", f"/{name}", body, {"Authorization": f"Bearer {live.token}"})
            answer = connection.getresponse()
            found = answer.status, json.loads(answer.read())
            connection.close()
            return found

        yield posted


@pytest.mark.parametrize("body", ["[]", "5", "null", "true", '"stop"', "{", "[" * 100_000, "\xff"])
@pytest.mark.parametrize("name", ["closing", "predict"])
def test_what_is_no_object_is_refused(post, live, name, body):
    status, answer = post(name, body)
    assert status == 400
    assert "JSON" in answer["error"]
    assert live.stops_when_closed


@pytest.mark.parametrize("stop", ["false", 0, None, []])
def test_only_a_truth_value_decides_what_closing_does(post, live, stop):
    status, answer = post("closing", json.dumps({"stop": stop}))
    assert (status, live.stops_when_closed) == (400, True)
    assert "true or false" in answer["error"]
    assert post("closing", '{"stop": false}')[0] == 200
    assert not live.stops_when_closed


@pytest.mark.parametrize("gait", [None, [], {}, {"period_s": 4}])
def test_what_is_no_gait_is_refused(post, gait):
    status, answer = post("predict", json.dumps({"gait": gait}))
    assert status == 400
    assert "a gait has period_s" in answer["error"]


@pytest.mark.parametrize("body", ["", "{}", "[]", "{", "[" * 100_000])
def test_a_stop_stops_whatever_comes_with_it(post, live, body):
    assert post("stop", body)[0] == 200
    assert live._pilot.stops == 1


def test_a_page_may_come_while_the_last_reports_are_waited_for(live):
    class Page:
        def empty(self) -> bool:
            live._watchers.add(Page())  # as another thread does
            return True

    live._watchers.add(Page())
    live.flush(0.1)
    assert len(live._watchers) > 1
