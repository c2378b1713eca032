#include "flash.h"

namespace bifa {

FlashText flash_text(const char* texts, uint8_t index) {
  for (; index > 0; --index) {
    while (flash_byte(texts++) != 0) continue;
  }
  return reinterpret_cast<FlashText>(texts);
}

}  // namespace bifa
