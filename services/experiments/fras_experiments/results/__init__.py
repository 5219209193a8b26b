"""What a campaign left: read, reduced to numbers, drawn, compared.

`reading` is the way in; `statistics` is pure; `summary`, `comparison` and `figures` put both
together; `command` stands behind `fras experiment report` and `fras experiment compare`.
"""
