// Arrays as packed_array.cc wrote them.
"use strict";

const DeepUav = {};

DeepUav.unpack = function (packed) {
  const text = atob(packed.data);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  const types = { f32: Float32Array, u16: Uint16Array, u8: Uint8Array };
  return new types[packed.type](bytes.buffer);
};

// Points x, y, z by turns, from 16 bits a coordinate.
DeepUav.unpackPoints = function (packed) {
  const shares = DeepUav.unpack(packed.points);
  const points = new Float32Array(shares.length);
  for (let i = 0; i < shares.length; ++i) {
    points[i] = packed.low[i % 3] + (packed.size[i % 3] * shares[i]) / 65535;
  }
  return points;
};
