"use strict";
// Figures: each is plotly's own data and layout, drawn as wide as the page.
function drawFigures(figures) {
  const config = { responsive: true, displaylogo: false, displayModeBar: false };
  return Promise.all(Object.entries(figures).map(([name, figure]) =>
    Plotly.newPlot(document.getElementById(name), figure.data, figure.layout, config)));
}

// The chip: points as squares on a canvas; positions and values are whole numbers of their range.
function playChip(chip, place) {
  const canvas = place.querySelector("canvas"), context = canvas.getContext("2d");
  const slider = place.querySelector("input"), button = place.querySelector("button");
  const choice = place.querySelector("select"), label = place.querySelector("output");
  const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0));
  const places = chip.frames.map(f => new Uint16Array(bytes(f.places).buffer));
  const values = chip.frames.map(f => Object.fromEntries(
    Object.entries(f.values).map(([name, text]) => [name, bytes(text)])));
  const [left, right, lower, upper] = chip.box;
  const legend = place.querySelector(".legend");
  slider.max = chip.frames.length - 1;
  slider.value = slider.max;

  function draw() {
    const width = Math.max(canvas.clientWidth, 100), ratio = window.devicePixelRatio || 1;
    const height = width * (upper - lower) / (right - left);
    canvas.style.height = height + "px";
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    const scale = canvas.width / (right - left), frame = Number(slider.value), field = choice.value;
    context.clearRect(0, 0, canvas.width, canvas.height);
    const tool = chip.frames[frame].tool;
    if (tool.length) {
      context.beginPath();
      tool.forEach(([x, y]) => context.lineTo((x - left) * scale, (upper - y) * scale));
      context.closePath();
      context.fillStyle = "#c9ced4";
      context.fill();
    }
    const side = Math.max(chip.spacing * scale * 1.35, 1), at = places[frame], colour = values[frame][field];
    for (let i = 0; i < colour.length; i++) {
      context.fillStyle = chip.colours[colour[i]];
      const x = at[2 * i] / 65535 * (right - left), y = at[2 * i + 1] / 65535 * (upper - lower);
      context.fillRect(x * scale - side / 2, canvas.height - y * scale - side / 2, side, side);
    }
    label.textContent = chip.frames[frame].time;
    const shown = chip.fields[field];
    legend.innerHTML = "";
    for (const text of [shown.low, null, shown.high]) {
      const part = document.createElement(text === null ? "i" : "span");
      if (text === null) part.style.background = `linear-gradient(90deg, ${chip.ramp.join(",")})`;
      else part.textContent = text;
      legend.append(part);
    }
  }
  let timer = null;
  function stop() { clearInterval(timer); timer = null; button.textContent = "Play"; }
  button.onclick = () => {
    if (timer) return stop();
    button.textContent = "Stop";
    timer = setInterval(() => {
      slider.value = (Number(slider.value) + 1) % chip.frames.length;
      draw();
    }, 150);
  };
  slider.oninput = () => { stop(); draw(); };
  choice.onchange = draw;
  window.addEventListener("resize", draw);
  draw();
}

const page = JSON.parse(document.getElementById("data").textContent);
drawFigures(page.figures).then(() => { document.documentElement.dataset.figures = Object.keys(page.figures).length; });
if (page.chip) playChip(page.chip, document.querySelector(".chip"));
