"""The process that serves a simulated workcell over Zenoh: goals, state, pictures, saved worlds."""
