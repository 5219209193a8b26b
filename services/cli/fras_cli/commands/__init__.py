"""Names, options and help of the `fras` commands; what they do stands in the modules above."""
