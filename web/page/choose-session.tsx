// The choice among the bundled sessions.

import { bundled, filesOf } from "./bundled";
import type { Opened } from "./main";

interface Props {
  label: string;
  /** What stands there while nothing is chosen. */
  placeholder: string;
  open: (opened: Opened) => void;
}

export function ChooseSession({ label, placeholder, open }: Props) {
  return (
    <label>
      {label}{" "}
      <select
        aria-label={label}
        value=""
        onChange={(event) => {
          const path = event.currentTarget.value;
          if (path) open({ files: filesOf(path), session: path.slice(path.lastIndexOf("/") + 1) });
        }}
      >
        <option value="">{placeholder}</option>
        {bundled.map(([path, about]) => (
          <option key={path} value={path}>
            {about}
          </option>
        ))}
      </select>
    </label>
  );
}
