// Colours of runs and of numbers.
"use strict";

// Okabe and Ito's, told apart by the colour-blind.
DeepUav.runColors = ["#1f8fd0", "#e0662a", "#12a37a", "#c8669b", "#d9a400", "#7b6fd0", "#56b4e9", "#8c6d46"];
DeepUav.runColor = (index) => DeepUav.runColors[index % DeepUav.runColors.length];

// From little to much: the maps "viridis" and "inferno" by a few of their colours.
DeepUav.colorMaps = {
  viridis: ["#440154", "#46327e", "#365c8d", "#277f8e", "#1fa187", "#4ac16d", "#a0da39", "#fde725"],
  error: ["#2dc0a0", "#9bd770", "#f7d84a", "#f59b2f", "#e8542f", "#b3154a"],
};

DeepUav.parseColor = function (hex) {
  return [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255);
};

// The colour [r, g, b] in 0..1 of a share in 0..1.
DeepUav.colorAt = function (name, share) {
  const stops = DeepUav.colorMaps[name];
  const place = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
  const low = Math.min(Math.floor(place), stops.length - 2);
  const [from, to] = [DeepUav.parseColor(stops[low]), DeepUav.parseColor(stops[low + 1])];
  return from.map((value, i) => value + (place - low) * (to[i] - value));
};

DeepUav.cssColor = (rgb) => `rgb(${rgb.map((value) => Math.round(255 * value)).join(",")})`;
DeepUav.cssGradient = (name) => `linear-gradient(to right, ${DeepUav.colorMaps[name].join(",")})`;
DeepUav.cssVariable = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

DeepUav.quantile = function (values, share) {
  const sorted = Float64Array.from(values).sort();
  return sorted.length ? sorted[Math.round(share * (sorted.length - 1))] : 0;
};
