// The test that determines the errors better: proposed, and added.

import { useEffect, useRef, useState } from "preact/hooks";
import { isStopped } from "./engine";
import { faultOf } from "./fault";
import type { Improvement, ProposedTest } from "./plan";
import { begun, Status, type Work } from "./status";

interface Props {
  improve: () => Promise<Improvement>;
  stop: () => void;
  /** The texts of the plan: a proposal is of them. */
  of: string;
  add: (step: ProposedTest) => void;
}

export function NextTest({ improve, stop, of, add }: Props) {
  const [proposal, setProposal] = useState<Improvement>();
  const [work, setWork] = useState<Work>();
  const [note, setNote] = useState("");
  const asked = useRef(0);
  useEffect(() => {
    asked.current += 1;
    setProposal(undefined);
    setWork(undefined);
    setNote("");
  }, [of]);
  const ask = async () => {
    const number = ++asked.current;
    setProposal(undefined);
    setNote("");
    setWork(begun("comparing candidate tests"));
    try {
      const found = await improve();
      if (number === asked.current) setProposal(found);
    } catch (error) {
      if (number === asked.current) setNote(isStopped(error) ? "stopped" : faultOf(error).message);
    }
    if (number === asked.current) setWork(undefined);
  };
  return (
    <>
      <h2>Next test</h2>
      <p class="actions">
        <button disabled={work !== undefined} onClick={() => void ask()}>
          Improve
        </button>
        <button disabled={!work} onClick={stop}>
          Stop
        </button>
        <Status work={work} note={note} />
      </p>
      {proposal && (
        <ul>
          {proposal.steps.map((step) => (
            <li key={step.test}>
              {step.test}, {step.duration_min.toFixed(1)} min: {proposal.criterion}{" "}
              {proposal.before?.toPrecision(3) ?? "∞"} → {step.after?.toPrecision(3) ?? "∞"}{" "}
              {step.session_toml && <button onClick={() => add(step)}>Add</button>}
            </li>
          ))}
          {proposal.steps.length === 0 && <li>No candidate test improves it.</li>}
        </ul>
      )}
    </>
  );
}
