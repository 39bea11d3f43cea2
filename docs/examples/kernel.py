import gacompiler
from gacompiler import kernel, sandwich
from gacompiler.algebra.catalog import PGA3
@kernel(v=PGA3.UNIT_EVEN, x=PGA3.POINT)
def move(v, x):
    return sandwich(v, x)
print(gacompiler.compile(move)([1, 0, 0, 0, 0, 0, -0.5, 0], [1.0, 2.0, 3.0]))     # one metre along z: [1. 2. 4.]
