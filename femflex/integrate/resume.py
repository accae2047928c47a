"""The head of a resume array: the numbers that every compiled method keeps between two kernel calls, by position.

A resume array is one flat float64 array: this head of HEAD numbers, then the method's vectors of n_x numbers each. It
is complete: a run continued from it takes the same steps, bit for bit, as one that was never stopped.
"""

METHOD = 0  # which method wrote it
N_X = 1  # number of states
T = 2  # time reached by the last accepted step
H = 3  # size of the next step
T_OLD = 4  # where the last accepted step began
LAST_OUT = 5  # last output time handed out; -inf before the first
DENSE = 6  # 1 when the vectors hold the interpolant of the last step
ERROR = 7  # scaled error of the last accepted step (controller memory)
REJECTED_LAST = 8  # 1 when the last trial was rejected: the next step may not grow
ACCEPTED = 9
REJECTED = 10
EVALUATIONS = 11
SMALLEST = 12
LARGEST = 13
COORDINATE = 14  # of the last rejection: first coordinate not finite, or that of the largest error
CAUSE = 15  # of the last rejection, or of the end: ERROR_TEST, NOT_FINITE, NEWTON, CREEPING, EVENT or INFEASIBLE
CONTRACTION = 16  # how much Newton's last corrections shrank each other (implicit methods)
HEAD = 17

ERROR_TEST, NOT_FINITE, NEWTON, CREEPING, EVENT, INFEASIBLE = 0, 1, 2, 3, 4, 5  # values of CAUSE
FULL, END, PAUSE, STUCK = 0, 1, 2, 3  # status of a kernel: rows full, interval done, budget used up, step too small
CONTINUE = 4  # none of these: the next trial step is taken
TINY, TINIEST = 1e-15, 1e-20  # the smallest step, relative to the time reached and to the end of the smooth interval
