from deepuav._program import main

main()
