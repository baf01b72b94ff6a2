"""Sends motion to other programs while it is tracked: VMC messages by OSC, JSON by WebSocket, the lab streaming layer."""
