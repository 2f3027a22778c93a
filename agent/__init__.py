"""From a sentence to actions: planners, the agent loop, clients."""
