"""A System laid out as flat arrays: records, pool of numbers, scratch."""
