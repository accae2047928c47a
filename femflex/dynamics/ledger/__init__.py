"""The terms of eq. (9) one by one, and motions from which some are left out."""
