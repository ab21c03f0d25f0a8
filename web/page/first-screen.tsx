// What stands there while nothing is open: what a session is, and examples.

import { filesOf } from "./bundled";
import type { Opened } from "./main";

interface Props {
  open: (opened: Opened) => void;
  explore: (opened: Opened) => void;
}

const EXAMPLES = [
  {
    path: "hermle-c600u/measured/session.toml",
    title: "Five-axis machine, ball bar",
    about: "Four measured tests. Press Trace: it finds the error that the model lacks.",
    isPlan: false,
  },
  {
    path: "r-test/measured/session.toml",
    title: "Rotary table, R-test",
    about: "Three displacements for each reading. Press Fit: it estimates the errors with their uncertainties.",
    isPlan: false,
  },
  {
    path: "hermle-c600u/chapter5.toml",
    title: "A plan, before the measurement",
    about: "Move the ball, the bar, an error, and see what the tests would tell.",
    isPlan: true,
  },
];

export function FirstScreen({ open, explore }: Props) {
  return (
    <div class="first">
      <p>
        A session is a folder of three kinds of files: the machine (its axes and their order), the tests (instrument,
        set-up and motion, in a file such as <code>session.toml</code>) and the readings of each test (CSV). From the
        readings <strong>Fit</strong> estimates the geometric errors of the axes with their uncertainties, and{" "}
        <strong>Trace</strong> finds the effect that the model lacks. Without readings a session is a plan, and{" "}
        <strong>Explore</strong> shows what its tests will determine before anything is measured.
      </p>
      <ul class="examples" aria-label="Examples">
        {EXAMPLES.map(({ path, title, about, isPlan }) => (
          <li key={path}>
            <button
              onClick={() =>
                (isPlan ? explore : open)({ files: filesOf(path), session: path.slice(path.lastIndexOf("/") + 1) })
              }
            >
              <strong>{title}</strong>
              <span>{about}</span>
            </button>
          </li>
        ))}
      </ul>
    </div>
  );
}
