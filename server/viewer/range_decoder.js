// The arithmetic coder of .tpm (docs/formats.md, "The coder"; proto/stream/range_coder.h is the same in
// C++), for bytes that come bit by bit: what was begun when the bytes ran out can be taken back.

/// Thrown when a byte is needed that has not come yet.
export const NEEDS_MORE = Symbol("needs more bytes");

export const NUMBER = 224; // models that a number takes: 64 lengths, 32 signs, 32 x 4 high bits

const ROOM = 1 << 10; // learnt bits between two checkpoints: fewer than 100 come from one split

export class RangeDecoder {
  #bytes;
  #quick;
  #slow;
  #at = 0;
  #range = 0xffffffff;
  #code = 0;
  // What the models were at the last checkpoint, newest last.
  #changed = new Uint32Array(ROOM);
  #was = new Uint16Array(2 * ROOM);
  #changes = 0;
  #kept = {at: 0, range: 0xffffffff, code: 0};

  /// `models`: how many learnt bits there are, numbered from 0.
  constructor(models) {
    this.#bytes = new Uint8Array(0);
    this.#quick = new Uint16Array(models).fill(1 << 15);
    this.#slow = new Uint16Array(models).fill(1 << 15);
  }

  /// All bytes of the code that have come so far; the array may be another one each time.
  set bytes(bytes) {
    this.#bytes = bytes;
  }
  /// How many bytes have been asked for.
  get asked() {
    return this.#at;
  }

  /// The first four bytes, once.
  start() {
    for (let i = 0; i < 4; ++i) this.#code = ((this.#code << 8) | this.#byte()) >>> 0;
  }

  checkpoint() {
    const kept = this.#kept;
    kept.at = this.#at;
    kept.range = this.#range;
    kept.code = this.#code;
    this.#changes = 0;
  }
  rollback() {
    for (let i = this.#changes; i-- > 0; ) {
      this.#quick[this.#changed[i]] = this.#was[2 * i];
      this.#slow[this.#changed[i]] = this.#was[2 * i + 1];
    }
    this.#changes = 0;
    ({at: this.#at, range: this.#range, code: this.#code} = this.#kept);
  }

  bit(model) {
    const quick = this.#quick[model];
    const slow = this.#slow[model];
    const changes = this.#changes++;
    this.#changed[changes] = model;
    this.#was[2 * changes] = quick;
    this.#was[2 * changes + 1] = slow;
    const estimate = (quick + slow) >>> 5;
    const split = (this.#range >>> 12) * (estimate < 1 ? 1 : estimate > 4095 ? 4095 : estimate);
    let one = 0;
    if (this.#code >= split) {
      one = 1;
      this.#code -= split;
      this.#range -= split;
      this.#quick[model] = quick - (quick >>> 4);
      this.#slow[model] = slow - (slow >>> 7);
    } else {
      this.#range = split;
      this.#quick[model] = quick + ((65535 - quick) >>> 4);
      this.#slow[model] = slow + ((65535 - slow) >>> 7);
    }
    while (this.#range < 0x1000000) this.#renew();
    return one;
  }

  /// `count` bits that are as likely as not, highest first; at most 32.
  plain(count) {
    let value = 0;
    while (count-- > 0) {
      this.#range >>>= 1;
      const one = this.#code >= this.#range ? 1 : 0;
      if (one) this.#code -= this.#range;
      value = ((value << 1) | one) >>> 0;
      while (this.#range < 0x1000000) this.#renew();
    }
    return value;
  }

  /// A number below 2^depth; its models begin at `first` (the one for node 0 is not used).
  tree(first, depth) {
    let node = 1;
    for (let i = 0; i < depth; ++i) node = (node << 1) | this.bit(first + node);
    return node - (1 << depth);
  }

  /// A whole number below 2^31 in size; its NUMBER models begin at `first`.
  number(first, signed = true) {
    const length = this.tree(first, 5);
    if (length === 0) return 0;
    const negative = signed && this.bit(first + 64 + length) === 1;
    const high = first + 96 + 4 * length;
    let value = 1;
    let left = length - 1;
    if (left > 0) {
      --left;
      value = 2 | this.bit(high);
    }
    if (left > 0) {
      --left;
      value = (value << 1) | this.bit(high + 1 + (value & 1));
    }
    while (left > 0) {
      const some = left < 16 ? left : 16;
      left -= some;
      value = (value << some) | this.plain(some);
    }
    return negative ? -value : value;
  }

  #renew() {
    const byte = this.#byte();
    this.#range = (this.#range << 8) >>> 0;
    this.#code = ((this.#code << 8) | byte) >>> 0;
  }
  #byte() {
    if (this.#at >= this.#bytes.length) throw NEEDS_MORE;
    return this.#bytes[this.#at++];
  }
}
