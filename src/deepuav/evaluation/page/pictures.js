// Pairs of keyframes side by side, with their key points and the landmarks they share.
"use strict";

DeepUav.PicturePair = class {
  constructor(parent, pair, title, settings) {
    Object.assign(this, { pair, settings, matches: DeepUav.unpack(pair.matches) });
    this.views = pair.views.map((view) => ({ ...view, points: DeepUav.unpack(view.points), mapped: DeepUav.unpack(view.mapped) }));
    const card = document.createElement("figure");
    card.className = "card";
    card.innerHTML = "<canvas></canvas><figcaption></figcaption>";
    card.querySelector("figcaption").textContent = title;
    parent.appendChild(card);
    this.canvas = card.querySelector("canvas");
    this.images = this.views.map((view) => {
      const image = new Image();
      image.onload = () => this.draw();
      if (view.image) image.src = view.image;
      return image;
    });
    this.canvas.role = "img";
    this.canvas.setAttribute("aria-label", title);
    this.draw();
  }

  draw() {
    const { width, height } = this.views[0];
    const scale = Math.min(1, 620 / width), gap = 8;
    this.canvas.width = Math.round(2 * width * scale) + gap;
    this.canvas.height = Math.round(height * scale);
    const context = this.canvas.getContext("2d");
    const origins = [0, Math.round(width * scale) + gap];
    this.views.forEach((view, side) => {
      const image = this.images[side];
      if (image.complete && image.naturalWidth) context.drawImage(image, origins[side], 0, width * scale, height * scale);
      if (this.settings.points) this.drawPoints(context, view, origins[side], scale);
    });
    if (this.settings.matches) this.drawMatches(context, origins, scale);
  }

  drawPoints(context, view, origin, scale) {
    for (let i = 0; i < view.mapped.length; ++i) {
      context.strokeStyle = view.mapped[i] ? "#2ee6a6" : "rgba(255,179,71,.75)";
      context.lineWidth = view.mapped[i] ? 1.6 : 1;
      context.beginPath();
      context.arc(origin + view.points[2 * i] * scale, view.points[2 * i + 1] * scale, view.mapped[i] ? 3 : 2, 0, 2 * Math.PI);
      context.stroke();
    }
  }

  // Coloured by height in the first image, so that neighbouring lines can be told apart.
  drawMatches(context, origins, scale) {
    context.lineWidth = 1;
    context.globalAlpha = 0.6;
    for (let i = 0; i < this.matches.length; i += 2) {
      const ends = [0, 1].map((side) => {
        const point = this.matches[i + side];
        return [origins[side] + this.views[side].points[2 * point] * scale, this.views[side].points[2 * point + 1] * scale];
      });
      context.strokeStyle = DeepUav.cssColor(DeepUav.colorAt("viridis", 0.35 + (0.65 * ends[0][1]) / this.canvas.height));
      context.beginPath();
      context.moveTo(...ends[0]);
      context.lineTo(...ends[1]);
      context.stroke();
    }
    context.globalAlpha = 1;
  }
};
