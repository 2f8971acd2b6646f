"""Motion made of rubber (Kwon & Lee 2008); the parts are being built."""
