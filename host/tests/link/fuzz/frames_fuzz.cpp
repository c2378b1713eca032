// Arbitrary bytes into the receive interrupt, with arbitrary pauses, while the robot walks: no access is out of bounds
// (the sanitizers watch), only a stop or the guard ends the walk, the host's stop ends it whatever came before, and after
// a pause the Uno answers as usual.
#include <stdlib.h>

#include <string>

#include "board_harness.cpp"
#include "frame.h"

namespace {

const uint16_t kKey = 1;  ///< of the sessions in the corpus; checks for another one do not come about by chance

/// Whether a stop may be among these bytes: `!`, a frame, or letters from which `stop` can be typed (with corrections).
bool may_stop(const std::string& bytes) {
  if (bytes.find('!') != std::string::npos || bytes.find('p') != std::string::npos) return true;
  const size_t kLength = bifa::kStopFrameBytes;  // of `stop` as well, which also has no fields
  for (size_t at = 0; at + kLength <= bytes.size(); ++at) {
    bifa::FrameDecoder decoder;
    decoder.start();
    for (size_t i = 0; i < kLength; ++i) decoder.feed(static_cast<uint8_t>(bytes[at + i]));
    if (!decoder.finish(bifa::session_seed(kKey))) continue;
    const bifa::MessageId message = static_cast<bifa::MessageId>(decoder.frame().message);
    if (message == bifa::MessageId::kStop || message == bifa::MessageId::kStopNow) return true;
  }
  return false;
}

/// The stop as the host sends it.
std::string host_stop() {
  const std::string frame(reinterpret_cast<const char*>(bifa::kStopFrame), bifa::kStopFrameBytes);
  const std::string once = std::string(2, '\0') + frame + '\0' + '!';
  return once + once;
}

void send(Board& board, const std::string& bytes) {
  board_send(&board, reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size());
}

bool walks_or_was_guarded(Board& board) {
  const bifa::Controller& controller = board.program->controller;
  return controller.state() == bifa::State::kRunning || controller.status().fault.fault == bifa::Fault::kHostSilent;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  Board board;
  send(board, "run\n");
  board_run(&board, 30, 0);
  std::string sent;
  for (size_t i = 0; i < size; ++i) {
    if (data[i] == 0x80 && i + 1 < size) {
      board_run(&board, 1 + data[++i] % 40, 0);
    } else {
      board_send(&board, data + i, 1);
      sent += static_cast<char>(data[i]);
    }
  }
  if (!may_stop(sent)) {
    board_run(&board, 1 + board.input.size() / kBytesPerMs, 0);
    if (!walks_or_was_guarded(board)) abort();
  }
  send(board, host_stop());
  board_run(&board, 2 + board.input.size() / kBytesPerMs, 0);
  if (board.valves != 0 || board.program->controller.state() < bifa::State::kStopped) abort();

  board_run(&board, 30, 0);
  send(board, "\n");
  board_run(&board, 5, 0);
  // Saves among the bytes keep the Uno busy for 0.3 s each; a line received meanwhile may be answered as damaged.
  for (int patience = 0; patience < 10; ++patience) {
    board.output.clear();
    send(board, "version\n");
    board_run(&board, 900, 0);
    if (std::string(board.output.begin(), board.output.end()).find("ok\r\n") != std::string::npos) return 0;
  }
  abort();
}
