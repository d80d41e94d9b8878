"""The firmware on emulated boards: builds it, runs it, compares with Python, and looks at what it costs."""
