// The whole of lib/ on a board of thin air: a serial line, an EEPROM, sensors at rest, valves that are only numbers.
#include <deque>
#include <vector>

#include "host_port.h"
#include "output.h"

namespace {

const int kBytesPerMs = 25;  // 250000 baud

// What a reset takes away.
struct Program {
  bifa::Controller controller;
  bifa::HostPort port{controller};
};

struct Board {
  Board() {
    memset(cells, 0xFF, sizeof cells);
    start(bifa::StartCause::kPower);
  }
  ~Board() { delete program; }

  void start(bifa::StartCause cause);
  void step();

  uint8_t valves = 0;
  uint8_t cells[bifa::kEepromBytes];
  int cells_busy_ms = 0;
  std::vector<uint8_t> output;
  std::deque<uint8_t> input;
  Program* program = nullptr;
  uint16_t boots = 0;
  uint32_t now_ms = 0;
  uint16_t wobble = 0;
};

Board* running = nullptr;  ///< the one whose program is at work

void Board::start(bifa::StartCause cause) {
  running = this;
  delete program;
  input.clear();
  valves = 0;
  program = new Program;
  program->port.begin(++boots, cause);
}

void Board::step() {
  running = this;
  ++now_ms;
  if (cells_busy_ms > 0) --cells_busy_ms;
  for (int i = 0; i < kBytesPerMs && !input.empty(); ++i) {
    program->port.byte_in_interrupt(input.front());
    input.pop_front();
    if (i % 8 == 7) program->port.poll();
  }
  program->port.tick_in_interrupt();
  if (program->controller.tick(false)) {
    wobble = (wobble + 1) % 16;  // a sensor whose reading never moves counts as broken
    const uint16_t rest = 4096 + wobble;
    program->controller.converted_in_interrupt({{rest, rest, rest}, 0});
  }
  program->controller.supply_told(true);
  program->port.poll();
}

}  // namespace

namespace bifa {
void set_valves(ValvePattern pattern) {
  const uint8_t bits = running->valves = pattern.bits();
  if (bits & (bits >> 1) & 0x15) __builtin_trap();  // both valves of a chamber
}
void outdate_input() { running->program->port.outdate(); }
uint8_t eeprom_read(uint16_t address) {
  if (address >= kEepromBytes) __builtin_trap();
  return running->cells[address];
}
void eeprom_write(uint16_t address, uint8_t value) {
  if (address >= kEepromBytes) __builtin_trap();
  running->cells[address] = value;
  running->cells_busy_ms = 4;
}
bool eeprom_busy() { return running->cells_busy_ms > 0; }
void output(uint8_t byte) { running->output.push_back(byte); }
uint8_t output_room() { return 127; }
}  // namespace bifa

extern "C" {

Board* board_new() { return new Board; }
void board_free(Board* board) { delete board; }
void board_reset(Board* board) { board->start(bifa::StartCause::kExternal); }
void board_send(Board* board, const uint8_t* data, size_t size) {
  board->input.insert(board->input.end(), data, data + size);
}

// Lets time pass; returns early once there is output.
void board_run(Board* board, uint32_t duration_ms, int until_output) {
  for (uint32_t i = 0; i < duration_ms; ++i) {
    if (until_output && !board->output.empty()) return;
    board->step();
  }
}
size_t board_receive(Board* board, uint8_t* data, size_t size) {
  const size_t count = board->output.size() < size ? board->output.size() : size;
  memcpy(data, board->output.data(), count);
  board->output.erase(board->output.begin(), board->output.begin() + count);
  return count;
}
uint32_t board_now_ms(Board* board) { return board->now_ms; }
uint8_t board_valves(Board* board) { return board->valves; }
uint8_t board_state(Board* board) { return static_cast<uint8_t>(board->program->controller.state()); }
}
