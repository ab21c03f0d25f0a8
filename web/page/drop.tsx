// Where files are dropped or chosen.

import { useState } from "preact/hooks";
import { chosen, dropped, type FileMap } from "./files";

interface Props {
  words: string;
  folders?: boolean;
  open: (files: FileMap) => void;
  failed: (error: unknown) => void;
}

export function Drop({ words, folders, open, failed }: Props) {
  const [over, setOver] = useState(false);
  const take = (files: Promise<FileMap>) => void files.then(open, failed);
  const input = (label: string, folder: boolean) => (
    <label class="button">
      {label}
      <input
        type="file"
        multiple
        {...(folder ? { webkitdirectory: true } : {})}
        onChange={(event) => {
          const list = [...(event.currentTarget.files ?? [])];
          event.currentTarget.value = "";
          if (list.length) take(chosen(list));
        }}
      />
    </label>
  );
  return (
    <div
      class={over ? "drop over" : "drop"}
      onDragOver={(event) => {
        event.preventDefault();
        setOver(true);
      }}
      onDragLeave={() => setOver(false)}
      onDrop={(event) => {
        event.preventDefault();
        setOver(false);
        if (event.dataTransfer) take(dropped(event.dataTransfer));
      }}
    >
      <p>{words}</p>
      {input("Choose files", false)}
      {folders && input("Choose a folder", true)}
    </div>
  );
}
