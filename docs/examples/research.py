import gacompiler
from gacompiler import symbolic
from gacompiler.algebra.catalog import VGA3

a, b = symbolic.symbols("a b", layout=VGA3.VECTOR)
mirrored = -b * a * symbolic.inverse(b)                 # in the plane orthogonal to b
print(mirrored["e1"].factor())
print(gacompiler.compile(symbolic.to_kernel(mirrored, a, b))([1.0, 2, 3], [0.0, 0, 2]))     # [ 1.  2. -3.]
