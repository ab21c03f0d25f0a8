// The drawing of a set-up. Its library is loaded when it is first shown.

import { useEffect, useLayoutEffect, useRef, useState } from "preact/hooks";
import type { Dragged, SetUp, SetUpScene } from "./scene";

interface Props {
  setUp: SetUp;
  /** The plan: when it is read again, the balls are where it has them. */
  of: unknown;
  axes: { name: string; unit: "deg" | "mm" }[];
  dragged: Dragged;
}

export function SetUpView({ setUp, of, axes, dragged }: Props) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const scene = useRef<SetUpScene | undefined>(undefined);
  const [wanted, setWanted] = useState(0);
  const last = setUp.stops.length - 1;
  const position = Math.max(0, Math.min(wanted, last));
  const latest = useRef({ setUp, position, dragged });
  latest.current = { setUp, position, dragged };
  const [fault, setFault] = useState("");
  useEffect(() => {
    let ended = false;
    let observer: ResizeObserver | undefined;
    import("./scene")
      .then(({ SetUpScene }) => {
        const element = canvas.current;
        if (ended || !element) return;
        const made = new SetUpScene(element, (ball, to) => latest.current.dragged(ball, to));
        scene.current = made;
        made.show(latest.current.setUp, latest.current.position);
        observer = new ResizeObserver(made.render);
        observer.observe(element);
        // For programs that operate the page.
        Object.assign(element, {
          placeOf: (ball: string) => made.place(ball),
          pointOf: (ball: string) => made.point(ball),
        });
      })
      .catch((error: unknown) => setFault(error instanceof Error ? error.message : String(error)));
    return () => {
      ended = true;
      observer?.disconnect();
      scene.current?.dispose();
    };
  }, []);
  // At once, so that the drawing is at the position that its caption states.
  useLayoutEffect(() => scene.current?.show(setUp, position), [setUp, of, position]);
  const at = (setUp.stops[position]?.at ?? []).map((number, k) => {
    const { name, unit } = axes[k];
    return `${name} ${Number(number.toFixed(unit === "deg" ? 2 : 1))}${unit === "deg" ? "°" : ""}`;
  });
  return (
    <figure>
      <canvas
        ref={canvas}
        class="drags"
        role="img"
        aria-label="Set-up of the test: table ball blue, tool ball red. The numbers beside it move them by keyboard."
        style={{ height: "300px" }}
      />
      {last > 0 && (
        <label class="position">
          <span>Position</span>
          <input
            type="range"
            min={0}
            max={last}
            step={1}
            value={position}
            aria-valuetext={at.join(", ")}
            onInput={(event) => setWanted(event.currentTarget.valueAsNumber)}
          />
          <output>
            {position + 1} of {last + 1}
          </output>
        </label>
      )}
      <figcaption>
        {fault ? (
          `The drawing needs WebGL: ${fault}. The numbers of the test do the same.`
        ) : (
          <>Balls and bar at {at.join(", ")}. Drag a ball (blue: table, red: tool), or turn the view.</>
        )}
      </figcaption>
    </figure>
  );
}
