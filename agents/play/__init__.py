"""The robot in the browser: a session that is a pure simulation, and a page that shows it and takes its inputs."""
