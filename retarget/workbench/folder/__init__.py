"""The folder that the workbench was opened in: what lies there, what comes into it, and nothing outside.

Read `filenames`, `listing`, `reach`, `sheets`, `upload`, then the `desk`, which is the page that is seen first.
"""
