"""The explorer: parameters by sliders, with all results beside each other, in the browser."""
