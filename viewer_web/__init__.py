"""The viewer of plan folders: `server` serves it, `src` (TypeScript) is built into `dist`."""
