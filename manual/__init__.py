"""The documentation: pages of the reference made from the code, and the site made of all pages."""
