// Slabs of samples: base64, deflate, and the predictor, which is that of the program bit for bit.

function fromBase64(id) {
  const element = byId(id);
  const text = element.textContent;
  element.remove();
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

async function inflated(bytes, length) {
  const stream = new DecompressionStream("deflate-raw");
  const writer = stream.writable.getWriter();
  writer.write(bytes).catch(() => {});
  writer.close().catch(() => {});
  const out = new Uint8Array(length);
  const reader = stream.readable.getReader();
  let at = 0;
  for (;;) {
    const { done, value } = await reader.read();
    if (done) break;
    out.set(value, at);
    at += value.length;
  }
  if (at !== length) throw new Error(`${at} bytes of ${length}`);
  return out;
}

const BEFORE = 1, MIRROR_X = 2, MIRROR_Y = 4;
const floats = new Float32Array(1), floatBits = new Int32Array(floats.buffer);

// What a sample misses of what was predicted: `lost` is zigzag.
const whole = (lost) => (lost >>> 1) ^ -(lost & 1);

// The layers of a slab, as bits, into `out` from layer `first` on. `count` layers of nx × ny.
function unpack(bytes, kind, nx, ny, first, count, out) {
  const area = nx * ny, plane = area * count;
  const values = kind === "float" ? new Float32Array(out.buffer, out.byteOffset, out.length) : null;
  const p0 = count, p1 = p0 + plane, p2 = p1 + plane, p3 = p2 + plane;
  for (let k = 0; k < count; k++) {
    const flags = bytes[k];
    const before = flags & BEFORE ? area : 0;
    const base = (first + k) * area;
    for (let j = 0; j < ny; j++) {
      const mirrorY = flags & MIRROR_Y && j > ny - 1 - j;
      for (let i = 0; i < nx; i++) {
        const at = base + j * nx + i;
        const b = k * area + j * nx + i;
        const lost = (bytes[p0 + b] << 24) | (bytes[p1 + b] << 16) | (bytes[p2 + b] << 8) | bytes[p3 + b];
        const mirrorX = flags & MIRROR_X && i > nx - 1 - i;
        if (mirrorY || mirrorX) {
          const from = out[mirrorY ? base + (ny - 1 - j) * nx + i : base + j * nx + nx - 1 - i];
          out[at] = lost === 0 ? from : values ? moved(from, whole(lost)) : from + whole(lost);
          continue;
        }
        if (values) {
          let guess = 0;
          if (i > 0 && j > 0) guess = values[at - 1] + values[at - nx] - values[at - nx - 1];
          else if (i > 0) guess = values[at - 1];
          else if (j > 0) guess = values[at - nx];
          if (before) {
            const o = at - area;
            let there = 0;
            if (i > 0 && j > 0) there = values[o - 1] + values[o - nx] - values[o - nx - 1];
            else if (i > 0) there = values[o - 1];
            else if (j > 0) there = values[o - nx];
            guess = guess + (values[o] - there);
          }
          floats[0] = guess;
          let bits = floatBits[0];
          if ((bits & 0x7f800000) === 0x7f800000) bits = 0;
          out[at] = lost === 0 ? bits : moved(bits, whole(lost));
        } else {
          let guess = 0;
          if (i > 0 && j > 0) guess = (out[at - 1] + out[at - nx] - out[at - nx - 1]) | 0;
          else if (i > 0) guess = out[at - 1];
          else if (j > 0) guess = out[at - nx];
          if (before) {
            const o = at - area;
            let there = 0;
            if (i > 0 && j > 0) there = (out[o - 1] + out[o - nx] - out[o - nx - 1]) | 0;
            else if (i > 0) there = out[o - 1];
            else if (j > 0) there = out[o - nx];
            guess = (guess + out[o] - there) | 0;
          }
          out[at] = guess + whole(lost);
        }
      }
    }
  }
}

// The float that is so many floats further.
function moved(bits, steps) {
  const place = ((bits < 0 ? ~bits : bits | 0x80000000) + steps) | 0;
  return place < 0 ? place & 0x7fffffff : ~place;
}

// Samples that are stored in slabs: of the surface, or of a channel.
class Samples {
  constructor(head, dims) {
    this.head = head;
    this.dims = dims;
    this.bits = null;
    this.bytes = null;
  }

  // Reads all slabs; `each` is told of every one and may wait.
  load(each) {
    this.loading ||= this.read(each);
    return this.loading;
  }

  async read(each) {
    const [nx, ny, nz] = this.dims;
    const bytes = fromBase64(this.head.data);
    const bits = new Int32Array(nx * ny * nz);
    let at = 0, first = 0;
    for (const length of this.head.slabs) {
      const count = Math.min(this.head.layers, nz - first);
      const slab = await inflated(bytes.subarray(at, at + length), count * (1 + 4 * nx * ny));
      unpack(slab, this.head.kind || "uint", nx, ny, first, count, bits);
      at += length;
      first += count;
      if (each) await each(first / nz);
    }
    this.bits = bits;
    this.values = this.head.kind === "float" ? new Float32Array(bits.buffer) : new Uint32Array(bits.buffer);
    return this;
  }

  at(i, j, k) {
    return this.values[(k * this.dims[1] + j) * this.dims[0] + i];
  }
}
