// Any bytes into the receive interrupt, with any pauses: nothing is read or written beyond its place, a walking robot
// is stopped by `!` and never by anything else, and after a pause the Uno answers as ever.
#include <stdlib.h>

#include <initializer_list>

#include "fuzz_board.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  FuzzBoard board;
  for (size_t i = 0; i < size; ++i) {
    if (data[i] == 0x80 && i + 1 < size) {
      board.run_ms(data[++i] % 40);
    } else {
      board.send(data[i]);
    }
  }
  board.run_ms(30);
  board.send('\n');
  board.run_ms(5);
  // Saves among the bytes keep it busy for 0.3 s each; a line that comes meanwhile may be answered as damaged.
  for (int patience = 0; patience < 10; ++patience) {
    text.clear();
    for (const char c : {'v', 'e', 'r', 's', 'i', 'o', 'n', '\n'}) board.send(static_cast<uint8_t>(c));
    board.run_ms(900);
    if (text.find("ok\r\n") != std::string::npos) return 0;
  }
  abort();
}
