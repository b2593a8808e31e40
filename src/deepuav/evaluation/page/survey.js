// A survey seen from above: orthophoto with cameras, overlap; and reprojection errors over the image.
"use strict";

DeepUav.addSurveyPicture = function (parent, title, aspect, source, draw) {
  const card = DeepUav.element("figure", "", "card");
  const canvas = document.createElement("canvas");
  const caption = document.createElement("figcaption");
  canvas.width = Math.round(aspect >= 1 ? 900 : 900 * aspect);
  canvas.height = Math.round(canvas.width / aspect);
  canvas.className = "survey-picture";
  canvas.role = "img";
  canvas.setAttribute("aria-label", title);
  caption.textContent = title;
  card.append(canvas, caption);
  parent.append(card);
  const context = canvas.getContext("2d");
  const image = new Image();
  image.onload = () => {
    context.drawImage(image, 0, 0, canvas.width, canvas.height);
    draw(context, canvas);
  };
  image.src = source;
  return caption;
};

DeepUav.drawCameras = function (cameras, context, canvas) {
  context.lineWidth = 1.5;
  for (const [x, y] of cameras) {
    context.beginPath();
    context.arc(x * canvas.width, y * canvas.height, 4, 0, 2 * Math.PI);
    context.fillStyle = "#ffd23f";
    context.fill();
    context.strokeStyle = "#222";
    context.stroke();
  }
};

DeepUav.addSurvey = function (parent, survey, name) {
  const title = name ? `${name}: ` : "";
  const cameras = (context, canvas) => DeepUav.drawCameras(survey.cameras, context, canvas);
  if (survey.orthophoto) {
    DeepUav.addSurveyPicture(parent, `${title}orthophoto and cameras; ${survey.about}`, survey.aspect, survey.orthophoto, cameras);
  }
  const legend = DeepUav.addSurveyPicture(parent, `${title}photographs that show each place:`, survey.aspect, survey.overlap, cameras);
  survey.overlap_colors.forEach((color, index) => {
    const swatch = DeepUav.element("i", "", "swatch overlap");
    swatch.style.background = color;
    legend.append(" ", swatch, ` ${index + 1}${index + 1 === survey.overlap_colors.length ? " and more" : ""}`);
  });
  const { picture, aspect, most_px, median_px } = survey.errors;
  DeepUav.addSurveyPicture(parent, `${title}reprojection error over the image: median ${median_px.toFixed(2)} px, from 0 (dark) to ${most_px.toFixed(2)} px (bright)`, aspect, picture, () => {});
};
