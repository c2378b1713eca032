"""The live page: `pilot` talks to the robot in the main thread, `server` to browsers in another."""
