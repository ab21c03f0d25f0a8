// Curves over the position of an axis, on a canvas.

import { useEffect, useRef } from "preact/hooks";

export interface Curve {
  values: Float64Array;
  colour: string;
  width: number;
}

export const COLOURS = ["#d1495b", "#2a7fba", "#3f9b57", "#b0721f", "#8e5bb5", "#1f9a9a", "#c75a9c", "#7a8a2a"];

/** A step of the scale: 1, 2 or 5 times a power of ten. */
function step(span: number, count: number): number {
  const raw = span / count || 1;
  const power = 10 ** Math.floor(Math.log10(raw));
  return ([1, 2, 5].find((factor) => factor * power >= raw) ?? 10) * power;
}

export function draw(canvas: HTMLCanvasElement, x: Float64Array, curves: Curve[], axis: string, unit: string): void {
  const density = devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, 200];
  if (width === 0) return;
  if (canvas.width !== Math.round(width * density)) canvas.width = Math.round(width * density);
  if (canvas.height !== Math.round(height * density)) canvas.height = Math.round(height * density);
  const pen = canvas.getContext("2d");
  if (!pen) return;
  const style = getComputedStyle(canvas);
  const colour = (name: string) => style.getPropertyValue(name);
  pen.setTransform(density, 0, 0, density, 0, 0);
  pen.clearRect(0, 0, width, height);
  let [low, high, left, right] = [0, 0, Infinity, -Infinity];
  for (const { values } of curves) {
    for (const value of values) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  for (const at of x) {
    if (at < left) left = at;
    if (at > right) right = at;
  }
  if (high - low < 1e-9) [low, high] = [low - 1, high + 1];
  if (!(right > left)) [left, right] = [0, 1];
  const box = { left: 46, right: width - 8, top: 8, bottom: height - 24 };
  const across = (value: number) => box.left + ((value - left) / (right - left)) * (box.right - box.left);
  const up = (value: number) => box.bottom - ((value - low) / (high - low)) * (box.bottom - box.top);
  pen.font = "11px system-ui, sans-serif";
  pen.fillStyle = colour("--soft");
  pen.strokeStyle = colour("--line");
  pen.lineWidth = 1;
  const each = (from: number, to: number, size: number, act: (value: number) => void) => {
    for (let k = Math.ceil(from / size); k * size <= to + 1e-12 * size; k++) act(Number((k * size).toPrecision(12)));
  };
  pen.textAlign = "right";
  pen.textBaseline = "middle";
  each(low, high, step(high - low, 4), (value) => {
    pen.beginPath();
    pen.moveTo(box.left, up(value));
    pen.lineTo(box.right, up(value));
    pen.stroke();
    pen.fillText(String(value), box.left - 4, up(value));
  });
  pen.textAlign = "center";
  pen.textBaseline = "top";
  each(left, right, step(right - left, 5), (value) => pen.fillText(String(value), across(value), box.bottom + 4));
  pen.textAlign = "left";
  pen.fillText(unit, box.left + 4, box.top);
  pen.textAlign = "right";
  pen.textBaseline = "bottom";
  pen.fillText(axis, box.right, box.bottom - 2);
  for (const curve of curves) {
    pen.strokeStyle = curve.colour || colour("--ink");
    pen.lineWidth = curve.width;
    pen.beginPath();
    const rows = Math.min(x.length, curve.values.length);
    for (let row = 0; row < rows; row++) {
      // A jump back to the start of the next run is not drawn.
      const jumps = row > 0 && Math.abs(x[row] - x[row - 1]) > 0.4 * (right - left);
      if (row === 0 || jumps) pen.moveTo(across(x[row]), up(curve.values[row]));
      else pen.lineTo(across(x[row]), up(curve.values[row]));
    }
    pen.stroke();
  }
}

interface Props {
  /** The number of its test. */
  test: number;
  title: string;
  x: Float64Array;
  curves: Curve[];
  axis: string;
  unit: string;
  drawn: () => void;
}

export function Chart({ test, title, x, curves, axis, unit, drawn }: Props) {
  const canvas = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    const element = canvas.current;
    if (!element) return;
    draw(element, x, curves, axis, unit);
    drawn();
    const observer = new ResizeObserver(() => draw(element, x, curves, axis, unit));
    observer.observe(element);
    return () => observer.disconnect();
  }, [x, curves]);
  const largest = curves[0]?.values.reduce((most, value) => Math.max(most, Math.abs(value)), 0) ?? 0;
  return (
    <figure data-test={test}>
      <canvas
        ref={canvas}
        role="img"
        aria-label={`${title}: largest ${largest.toPrecision(3)} ${unit}`}
        style={{ height: "200px" }}
      />
      <figcaption>
        {title}: largest {largest.toPrecision(3)} {unit}
      </figcaption>
    </figure>
  );
}
