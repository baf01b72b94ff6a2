"""Motion given to other programs as it is tracked: OSC in VMC's messages, JSON over a WebSocket, the lab streaming layer."""
