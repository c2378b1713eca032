// The two 16-bit checks of frames, each a few instructions. Together they miss one random error in 2^31, not in 2^32,
// because their polynomials share the factor x + 1 (docs/protocol.md).
#pragma once

#include <stdint.h>

#ifdef __AVR__
#include <util/crc16.h>
#endif

namespace bifa {

/// CRC-16, polynomial 0x1021, most significant bit first: Python's binascii.crc_hqx(data, crc).
inline uint16_t crc16_update(uint16_t crc, uint8_t byte) {
#ifdef __AVR__
  return _crc_xmodem_update(crc, byte);
#else
  crc ^= static_cast<uint16_t>(byte << 8);
  for (int bit = 0; bit < 8; ++bit) {
    crc = static_cast<uint16_t>(crc & 0x8000 ? (crc << 1) ^ 0x1021 : crc << 1);
  }
  return crc;
#endif
}

/// CRC-16, polynomial 0x8005, least significant bit first (known as CRC-16/ARC or Modbus).
inline uint16_t crc16_reflected_update(uint16_t crc, uint8_t byte) {
#ifdef __AVR__
  return _crc16_update(crc, byte);
#else
  crc ^= byte;
  for (int bit = 0; bit < 8; ++bit) {
    crc = static_cast<uint16_t>(crc & 1 ? (crc >> 1) ^ 0xA001 : crc >> 1);
  }
  return crc;
#endif
}

const uint16_t kCrcSeed = 0xFFFF;

/// CRC-16 (0x1021) of a block in RAM.
inline uint16_t crc16(const void* data, uint8_t size, uint16_t seed = kCrcSeed) {
  const uint8_t* bytes = static_cast<const uint8_t*>(data);
  for (uint8_t i = 0; i < size; ++i) seed = crc16_update(seed, bytes[i]);
  return seed;
}

}  // namespace bifa
