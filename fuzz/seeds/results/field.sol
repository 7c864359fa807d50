MeshVersionFormatted 2

Dimension 2

SolAtVertices
4
2 1 2

1 0.5 0
2 1 0
3 1 1
4 0 1

End
