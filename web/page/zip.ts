// What the directory at the end of a ZIP file states: the checksums by which damage is found.
// APPNOTE.TXT of PKWARE, 4.3.12 (central directory), 4.3.16 (its end).

import { strFromU8 } from "fflate";

const DIRECTORY_ENTRY = 0x02014b50;
const DIRECTORY_END = 0x06054b50;
const DIRECTORY_END_BYTES = 22;
const LONGEST_COMMENT = 0xffff;
/** Bit 11 of the flags: the name is UTF-8. */
const UTF8_NAME = 1 << 11;

const TABLE = Uint32Array.from({ length: 256 }, (_, byte) => {
  let rest = byte;
  for (let bit = 0; bit < 8; bit++) rest = rest & 1 ? (rest >>> 1) ^ 0xedb88320 : rest >>> 1;
  return rest;
});

/** The checksum of ZIP files. */
export function crc32(bytes: Uint8Array): number {
  let rest = 0xffffffff;
  for (const byte of bytes) rest = TABLE[(rest ^ byte) & 0xff] ^ (rest >>> 8);
  return ~rest >>> 0;
}

/**
 * The checksums of the entries, by name; several if several entries have one name. Undefined if there is no directory,
 * or it is not whole. Files of ZIP64 have larger numbers, which files within the limits of this page do not need.
 */
export function directory(bytes: Uint8Array): Map<string, number[]> | undefined {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  let end = bytes.length - DIRECTORY_END_BYTES;
  const first = Math.max(0, end - LONGEST_COMMENT);
  while (end >= first && view.getUint32(end, true) !== DIRECTORY_END) end -= 1;
  if (end < first) return undefined;
  const count = view.getUint16(end + 10, true);
  const found = new Map<string, number[]>();
  // Files may stand before the archive, so that places count from its end.
  let at = end - view.getUint32(end + 12, true);
  for (let entry = 0; entry < count; entry++) {
    if (at < 0 || at + 46 > end || view.getUint32(at, true) !== DIRECTORY_ENTRY) return undefined;
    const nameEnd = at + 46 + view.getUint16(at + 28, true);
    if (nameEnd > end) return undefined;
    const isUtf8 = (view.getUint16(at + 8, true) & UTF8_NAME) !== 0;
    const name = strFromU8(bytes.subarray(at + 46, nameEnd), !isUtf8);
    const sum = view.getUint32(at + 16, true);
    const same = found.get(name);
    if (same) same.push(sum);
    else found.set(name, [sum]);
    at = nameEnd + view.getUint16(at + 30, true) + view.getUint16(at + 32, true);
  }
  return at === end ? found : undefined;
}
