// Arbitrary bytes into the receive interrupt, with arbitrary pauses: no access is out of bounds (the sanitizers watch),
// and after a pause the Uno answers as usual.
#include <stdlib.h>

#include <string>

#include "board_harness.cpp"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  Board board;
  for (size_t i = 0; i < size; ++i) {
    if (data[i] == 0x80 && i + 1 < size) {
      board_run(&board, 1 + data[++i] % 40, 0);
    } else {
      board_send(&board, data + i, 1);
    }
  }
  const uint8_t end = '\n', question[] = "version\n";
  board_run(&board, 30 + size / kBytesPerMs, 0);
  board_send(&board, &end, 1);
  board_run(&board, 5, 0);
  // Saves among the bytes keep the Uno busy for 0.3 s each; a line received meanwhile may be answered as damaged.
  for (int patience = 0; patience < 10; ++patience) {
    board.output.clear();
    board_send(&board, question, sizeof question - 1);
    board_run(&board, 900, 0);
    if (std::string(board.output.begin(), board.output.end()).find("ok\r\n") != std::string::npos) return 0;
  }
  abort();
}
