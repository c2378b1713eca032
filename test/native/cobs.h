// Consistent Overhead Byte Stuffing, in its most readable form: the reference for the Uno's implementation.
#pragma once

#include <stdint.h>

#include <string>

static std::string cobs(const std::string& body) {
  std::string coded;
  for (size_t at = 0; at <= body.size();) {
    size_t end = body.find('\0', at);
    if (end == std::string::npos) end = body.size();
    coded += static_cast<char>(end - at + 1);
    coded += body.substr(at, end - at);
    at = end + 1;
  }
  return coded;
}
