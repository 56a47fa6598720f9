"""3D pages in the browser with viser: a server with access control, scene lighting, and self-contained HTML pages."""
