"""Page of a run in a browser, by bokeh, and its server."""
