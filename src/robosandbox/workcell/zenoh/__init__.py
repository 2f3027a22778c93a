"""The workcell over Zenoh: the messages, who may say what, the process that serves, and its clients."""
