// Plots of a course on a canvas: one line, its limits, seconds below.

const INK = "#1f2328";
const FAINT = "#57606a";
const WINDOW_S = 24;

/**
 * Draw a course.
 * @param {HTMLCanvasElement} canvas
 * @param {{at: number[], values: number[], top: number, colour: string, limits: {value: number, colour: string}[], unit: string}} plot
 */
export function draw(canvas, plot) {
  const scale = window.devicePixelRatio || 1;
  const width = canvas.clientWidth;
  const height = Number(canvas.dataset.height);
  canvas.style.height = `${height}px`;
  canvas.width = Math.round(width * scale); // clears it
  canvas.height = Math.round(height * scale);
  paint(canvas.getContext("2d"), width, height, scale, plot);
}

function paint(context, width, height, scale, plot) {
  context.scale(scale, scale);
  const left = 42, bottom = 16, top = 4;
  const end = plot.at.length ? plot.at[plot.at.length - 1] : 0;
  const begin = Math.max(0, end - WINDOW_S);
  const x = (at) => left + ((at - begin) / WINDOW_S) * (width - left - 4);
  const y = (value) => height - bottom - (Math.min(value, plot.top) / plot.top) * (height - bottom - top);
  context.strokeStyle = "#d0d7de";
  context.strokeRect(left, top, width - left - 4, height - bottom - top);
  context.fillStyle = FAINT;
  context.font = "11px system-ui, sans-serif";
  context.textAlign = "right";
  context.fillText(`${plot.top}${plot.unit}`, left - 3, top + 9);
  context.fillText("0", left - 3, height - bottom);
  context.textAlign = "left";
  context.fillText(`${begin.toFixed(0)} s`, left, height - 3);
  context.textAlign = "right";
  context.fillText(`${(begin + WINDOW_S).toFixed(0)} s`, width - 4, height - 3);
  context.setLineDash([5, 4]);
  for (const limit of plot.limits) {
    context.strokeStyle = limit.colour;
    line(context, [[left, y(limit.value)], [width - 4, y(limit.value)]]);
  }
  context.setLineDash([]);
  context.strokeStyle = plot.colour || INK;
  context.lineWidth = 1.8;
  const points = [];
  plot.at.forEach((at, index) => {
    if (at >= begin) points.push([x(at), y(plot.values[index])]);
  });
  line(context, points);
}

function line(context, points) {
  context.beginPath();
  points.forEach(([x, y], index) => (index ? context.lineTo(x, y) : context.moveTo(x, y)));
  context.stroke();
}
