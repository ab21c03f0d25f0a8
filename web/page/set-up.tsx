// The drawing of a set-up. Its library is loaded when it is first shown.

import { useEffect, useRef, useState } from "preact/hooks";
import type { Dragged, SetUp, SetUpScene } from "./scene";

export function SetUpView({ setUp, dragged }: { setUp: SetUp; dragged: Dragged }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const scene = useRef<SetUpScene | undefined>(undefined);
  const latest = useRef({ setUp, dragged });
  latest.current = { setUp, dragged };
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
        made.show(latest.current.setUp);
        observer = new ResizeObserver(made.render);
        observer.observe(element);
        // For programs that operate the page.
        Object.assign(element, { placeOf: (ball: string) => made.place(ball) });
      })
      .catch((error: unknown) => setFault(error instanceof Error ? error.message : String(error)));
    return () => {
      ended = true;
      observer?.disconnect();
      scene.current?.dispose();
    };
  }, []);
  useEffect(() => scene.current?.show(setUp), [setUp]);
  return (
    <figure>
      <canvas
        ref={canvas}
        class="drags"
        role="img"
        aria-label="Set-up of the test: table ball blue, tool ball red. The numbers beside it move them by keyboard."
        style={{ height: "300px" }}
      />
      <figcaption>
        {fault
          ? `The drawing needs WebGL: ${fault}. The numbers of the test do the same.`
          : "Drag a ball (blue: table, red: tool; at zero positions of the axes), or turn the view."}
      </figcaption>
    </figure>
  );
}
