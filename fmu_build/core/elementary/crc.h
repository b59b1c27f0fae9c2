/* crc.h - CRC-32 (ISO 3309, as in ZIP) of block files and saved states, which detects damage before use. */
#ifndef HYST_CRC_H
#define HYST_CRC_H
#include <stddef.h>
#include <stdint.h>

static inline uint32_t hyst_crc32(const unsigned char *b, size_t n) {
  uint32_t crc = 0xffffffffu;
  for (size_t i = 0; i < n; i++) {
    crc ^= b[i];
    for (int k = 0; k < 8; k++) crc = crc & 1 ? crc >> 1 ^ 0xedb88320u : crc >> 1;
  }
  return ~crc;
}
#endif
