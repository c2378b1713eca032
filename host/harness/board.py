"""The Uno's own code on this computer (board_harness.cpp) as transport and clock of the link, in virtual time."""

from pathlib import Path

from harness.native import load

ffi, lib = load(
    Path(__file__).with_name("board_harness.cpp"),
    """
    typedef struct Board Board;
    Board* board_new(void); void board_free(Board*); void board_reset(Board*);
    void board_send(Board*, const uint8_t*, size_t); void board_run(Board*, uint32_t ms, int until_output);
    size_t board_receive(Board*, uint8_t*, size_t); uint32_t board_now_ms(Board*);
    uint8_t board_valves(Board*); uint8_t board_state(Board*);
    """,
)
STATES = ("idle", "running", "holding", "stopped", "fault")


class Board:
    """A board without a robot; transport and clock in one, in steps of a millisecond."""

    def __init__(self) -> None:
        self._board = ffi.gc(lib.board_new(), lib.board_free)
        self._buffer = ffi.new("uint8_t[65536]")

    def write(self, data: bytes) -> None:
        lib.board_send(self._board, data, len(data))

    def read(self, timeout_s: float) -> bytes:
        lib.board_run(self._board, -int(-timeout_s * 1000 // 1), 1)
        return self.receive()

    def receive(self) -> bytes:
        count = lib.board_receive(self._board, self._buffer, 65536)
        return bytes(ffi.buffer(self._buffer, count))

    def reset(self) -> None:
        lib.board_reset(self._board)

    def close(self) -> None:
        pass

    def now(self) -> float:
        return lib.board_now_ms(self._board) / 1000

    def sleep(self, duration_s: float) -> None:
        lib.board_run(self._board, round(duration_s * 1000), 0)

    def type(self, line: str) -> list[str]:
        """Type a line, wait, and return the lines that come back."""
        self.write(line.encode() + b"\n")
        self.sleep(0.8 if line.split()[:1] in (["save"], ["forget"], ["defaults"], ["zero"]) else 0.02)
        return self.receive().decode("latin1").splitlines()

    @property
    def valves(self) -> int:
        return lib.board_valves(self._board)

    @property
    def state(self) -> str:
        return STATES[lib.board_state(self._board)]
