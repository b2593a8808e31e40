// What the program sends, by WebSocket: texts are JSON, the rest as view_messages.h says.
"use strict";

// {kind, ...} of the header, with what follows it unpacked.
DeepUav.parseMessage = function (data) {
  if (typeof data === "string") return JSON.parse(data);
  const length = new DataView(data).getUint32(0, true);
  const message = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
  const body = data.slice(4 + length);
  if (message.kind === "picture") return DeepUav.withPicture(message, body);
  return DeepUav.withMap(message, body);
};

DeepUav.withPicture = function (message, body) {
  const shares = new Uint16Array(body, 0, 2 * message.points);
  return { ...message, shares, jpeg: new Blob([new Uint8Array(body, 4 * message.points)], { type: "image/jpeg" }) };
};

DeepUav.withMap = function (message, body) {
  const shares = new Uint16Array(body, 0, 3 * message.points);
  const points = new Float32Array(shares.length);
  for (let i = 0; i < points.length; ++i) points[i] = message.low[i % 3] + (message.size[i % 3] * shares[i]) / 65535;
  const floats = new Float32Array(body.slice(6 * message.points));
  const positions = new Float32Array(3 * message.keyframes), rotations = new Float32Array(4 * message.keyframes);
  for (let i = 0; i < message.keyframes; ++i) {
    positions.set(floats.subarray(7 * i, 7 * i + 3), 3 * i);
    rotations.set(floats.subarray(7 * i + 3, 7 * i + 7), 4 * i);
  }
  const poses = 7 * message.keyframes, path = floats.subarray(poses, poses + 3 * message.path);
  return { ...message, points, positions, rotations, path, loops: floats.subarray(poses + 3 * message.path) };
};

// Calls `listener` with each message, and `state` with whether the program is there; asks again where it is not.
DeepUav.connect = function (listener, state) {
  const socket = new WebSocket(`ws://${location.host}/messages`);
  socket.binaryType = "arraybuffer";
  socket.onopen = () => state(true);
  socket.onmessage = (event) => listener(DeepUav.parseMessage(event.data));
  socket.onclose = () => {
    state(false);
    setTimeout(() => DeepUav.connect(listener, state), 2000);
  };
};
