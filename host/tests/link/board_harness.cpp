// The whole of lib/ on a board of thin air: a serial line, an EEPROM, sensors at rest, valves that are only numbers.
#include <deque>
#include <vector>

#include "host_port.h"

namespace {

const int kBytesPerMs = 25;  // 250000 baud

class Valves : public bifa::ValvePins {
 public:
  void write(bifa::ValvePattern pattern) override { bits = pattern.bits(); }
  uint8_t bits = 0;
};

class Cells : public bifa::Eeprom {
 public:
  uint8_t read(uint16_t address) override { return bytes[address % bifa::kEepromBytes]; }
  void write(uint16_t address, uint8_t value) override {
    bytes[address % bifa::kEepromBytes] = value;
    busy_ms = 4;
  }
  bool busy() override { return busy_ms > 0; }
  uint8_t bytes[bifa::kEepromBytes];
  int busy_ms = 0;
};

class Output : public bifa::Sink {
 public:
  void write(uint8_t byte) override { bytes.push_back(byte); }
  uint8_t room() const override { return 127; }
  std::vector<uint8_t> bytes;
};

// What a reset takes away.
struct Program {
  Program(Valves& valves, Cells& cells, Output& output) : controller(valves), port(controller, cells, output) {}
  bifa::Controller controller;
  bifa::HostPort port;
};

struct Board {
  Valves valves;
  Cells cells;
  Output output;
  std::deque<uint8_t> input;
  Program* program = nullptr;
  uint16_t boots = 0;
  uint32_t now_ms = 0;
  uint16_t wobble = 0;
  int32_t stopped_after_ms = -1;

  void start(bifa::StartCause cause) {
    delete program;
    input.clear();
    valves.bits = 0;
    program = new Program(valves, cells, output);
    program->port.begin(++boots, cause);
  }

  void step() {
    ++now_ms;
    if (cells.busy_ms > 0) --cells.busy_ms;
    for (int i = 0; i < kBytesPerMs && !input.empty(); ++i) {
      if (program->port.byte_in_interrupt(input.front())) program->controller.stop_in_interrupt();
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
};

}  // namespace

extern "C" {

Board* board_new() {
  Board* board = new Board;
  memset(board->cells.bytes, 0xFF, sizeof board->cells.bytes);
  board->start(bifa::StartCause::kPower);
  return board;
}
void board_free(Board* board) {
  delete board->program;
  delete board;
}
void board_reset(Board* board) { board->start(bifa::StartCause::kExternal); }
void board_send(Board* board, const uint8_t* data, size_t size) {
  board->input.insert(board->input.end(), data, data + size);
}

// Lets time pass; returns early once there is output.
void board_run(Board* board, uint32_t duration_ms, int until_output) {
  for (uint32_t i = 0; i < duration_ms; ++i) {
    if (until_output && !board->output.bytes.empty()) return;
    board->step();
  }
}
size_t board_receive(Board* board, uint8_t* data, size_t size) {
  const size_t count = board->output.bytes.size() < size ? board->output.bytes.size() : size;
  memcpy(data, board->output.bytes.data(), count);
  board->output.bytes.erase(board->output.bytes.begin(), board->output.bytes.begin() + count);
  return count;
}
uint32_t board_now_ms(Board* board) { return board->now_ms; }
uint8_t board_valves(Board* board) { return board->valves.bits; }
uint8_t board_state(Board* board) { return static_cast<uint8_t>(board->program->controller.state()); }
void board_eeprom(Board* board, uint8_t* image) { memcpy(image, board->cells.bytes, sizeof board->cells.bytes); }
}
